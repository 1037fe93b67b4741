# Lets `snakemake` find the workflow from the root of the repository.
include: "workflow/Snakefile"


# An included file's default target does not count.
workflow.default_target = "all"
