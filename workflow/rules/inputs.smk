# What a rule's wildcards stand for: input files, parameters, and the files of a whole run.
from hashlib import sha256

from rippletwin.learning.architectures import LONGEST_TRAININGS

# ---- what a whole run makes ----


def get_final_output():
    """What a whole run makes of the case with the configured datasets, networks and faults.

    Networks are trained where there is something to ask them: a recording of a known fault that
    scores them, or one of unknown state.
    """
    wanted = [rules.report_page.output]
    if HAS_PERIODIC:
        wanted.append(rules.plot_calibration.output)
        wanted += expand_outputs(rules.plot_seeds.output, dataset=SIMULATED)
        if PRESSURES and HAS_KNOWN:
            wanted.append(rules.compare_sst.output)
        if SIMULATED and STATES["compound"]:
            wanted += expand_outputs(
                rules.plot_compound_seeds.output, dataset=SIMULATED
            )
    if ASKED_HERE:
        wanted.append(rules.ask_networks.output)
    if RANDOMISED and of_domain("time") and (SCORED_HERE or ASKED_HERE):
        wanted.append(rules.unlike_table.output)
    return wanted + (scores() if SCORED_HERE else [])


def scores():
    """What comes of networks that recordings of known faults score."""
    wanted = [
        rules.accuracy_table.output,
        rules.recording_table.output,
        rules.claims.output,
        rules.plot_accuracy.output,
        expand_outputs(rules.plot_confusion.output, dataset=CHOSEN),
    ]
    if corrected_pairs():
        wanted.append(rules.report_cost.output)
    if SIMULATED:
        wanted += [rules.attention_table.output, rules.plot_ranks.output]
        domains = [name for name in ("time", "image") if of_domain(name)]
        wanted += expand_outputs(
            rules.plot_attention.output, dataset=SIMULATED, domain=domains
        )
    if SIMULATED and STATES["compound"]:
        wanted.append(rules.report_compound.output)
    return wanted


# ---- the pump and its line ----


def leak_area_of(wildcards):
    """Fault -> its leak, m2, for every fault of the state."""
    areas = config["faults"]["leak_area"]
    faults = wildcards.state.split("+")
    return {fault: areas[fault] for fault in faults if fault in areas}


def twin_of(wildcards):
    """The calibrated twin, or the one that `explain` corrected, of wildcards or of a dataset."""
    made_by = {"calibrated": rules.calibrate, "corrected": rules.explain}
    return made_by[wildcards.twin].output.twin


def states_of(wildcards):
    """A store for each simulated state, of the line that carries the dataset's ripple."""
    dataset = DATASETS[wildcards.dataset]
    folder = f"propagated/{dataset.twin}" if dataset.line == "twin" else "faults"
    return expand(f"{RESULTS}/{folder}/{{state}}.zarr", state=STATES[wildcards.faults])


def seed_variable_of(wildcards):
    """Variable of these stores; a flow sensor sees the flow that any line can be driven with."""
    by_signal = {"pressure": "pressure", "flow": "source_flow"}
    return by_signal[DATASETS[wildcards.dataset].signal]


def bandwidth_of(wildcards):
    """Highest frequency of a dataset's signal, Hz, where it is flow; pressure has none, so that an
    edit of the flow sensor's reruns no dataset of pressure."""
    is_flow = DATASETS[wildcards.dataset].signal == "flow"
    return config["flow_sensor"]["bandwidth_hz"] if is_flow else None


def pinn_setting(name):
    """A setting of the physics-informed network; None where the flow sensor is without one."""
    sensor = config["flow_sensor"]
    return sensor["pinn"][name] if sensor["method"] == "pinn" else None


# ---- samples ----


def every_seed(path):
    """A pattern of stores with one for each {seed}; other wildcards stay."""
    seeds = range(config["seeds"])
    return [f"{RESULTS}/{path}".replace("{seed}", str(seed)) for seed in seeds]


def recorded_signal_of(wildcards):
    """Recorded windows of a dataset's signal; flow is estimated through the line of its twin."""
    dataset = DATASETS[wildcards.dataset]
    kind = f"flow_{dataset.twin}" if dataset.signal == "flow" else "pressure"
    return f"{RESULTS}/recordings/{kind}.zarr"


def signals_of(wildcards):
    """Noise-free revolutions that samples of a dataset are made from: many a class, or one."""
    if wildcards.faults == "single" and DATASETS[wildcards.dataset].randomised == "yes":
        return f"{RESULTS}/randomised/{wildcards.dataset}/learnt.zarr"
    return f"{RESULTS}/seeds/{wildcards.dataset}/{wildcards.faults}.zarr"


def samples_per_class_of(wildcards):
    counts = config["samples_per_class"]
    count = counts["time" if wildcards.revolutions == "1" else "image"]
    randomised = DATASETS[wildcards.dataset].randomised == "yes"
    return count * counts["randomised"] if randomised else count


def reference_of(wildcards):
    """What the images of a dataset are scaled by."""
    if DATASETS[wildcards.dataset].line == "rig":
        return recorded_signal_of(wildcards)
    return f"{RESULTS}/seeds/{wildcards.dataset}/single.zarr"


# ---- networks ----


def for_network(wildcards, time, image):
    """The one of two paths that has the input of the wildcards' network."""
    is_image = ARCHITECTURES[wildcards.architecture].domain == "image"
    return image if is_image else time


def recorded_of(wildcards):
    """What a network is tested on."""
    images = f"{RESULTS}/images/{{dataset}}/recorded.zarr"
    return for_network(wildcards, recorded_signal_of(wildcards), images)


def samples_of(wildcards):
    """What a network learns from, as a list: a store for each seed, or that of the recordings."""
    if DATASETS[wildcards.dataset].line == "rig":
        return [recorded_of(wildcards)]
    return for_network(
        wildcards,
        every_seed("samples/{dataset}/single/{seed}x1.zarr"),
        every_seed("images/{dataset}/single/{seed}.zarr"),
    )


def probes_of(wildcards):
    """Simulated states without noise, as a network takes them."""
    return for_network(
        wildcards,
        f"{RESULTS}/samples/{{dataset}}/probex1.zarr",
        f"{RESULTS}/images/{{dataset}}/probe.zarr",
    )


def compound_samples_of(wildcards):
    """Samples of compound faults for a network of a dataset, of the first seed."""
    return for_network(
        wildcards,
        f"{RESULTS}/samples/{{dataset}}/compound/0x1.zarr",
        f"{RESULTS}/images/{{dataset}}/compound/0.zarr",
    )


def priority_of(wildcards):
    """Start the longest trainings first."""
    name = wildcards.architecture
    return 20 - LONGEST_TRAININGS.index(name) if name in LONGEST_TRAININGS else 10


def learnt_share_of(wildcards):
    """Early share of every recording that is not tested. Of this share networks learn from
    recordings, and randomised signals have the pistons and the model error of the healthy one; 0
    where simulations do without."""
    dataset = DATASETS[wildcards.dataset]
    from_recordings = dataset.line == "rig" or dataset.randomised == "yes"
    return config["experimental"]["training_share"] if from_recordings else 0.0


def cylinder_class_of(wildcards):
    """Class of a recorded cylinder fault where networks learn from recordings, as in scoring."""
    dataset = DATASETS[wildcards.dataset]
    return config["scoring"][dataset.signal] if dataset.line == "rig" else None


# ---- tables ----


def scored_population():
    """The scored recordings of a diagnosis trial in the results folder and a digest of them, none
    where there is no trial. The page shows them and never starts a trial: they are no input.
    """
    rows = Path(f"{RESULTS}/diagnosis_trial/rows.json")
    return [str(rows), sha256(rows.read_bytes()).hexdigest()] if rows.exists() else []


def shown_attention():
    """Pictures of attention on the page: of the first simulated dataset, on time windows."""
    if not SCORED_HERE or not SIMULATED or not of_domain("time"):
        return []
    name = f"{RESULTS}/figures/attention_{SIMULATED[0]}_time_{{windows}}.png"
    return expand(name, windows=["simulated", "recorded"])


def table_columns():
    """Datasets of the accuracy table from left to right: the configured ones and the paper's."""
    paper = set(pd.read_csv(PAPER)["dataset"])
    return [name for name in DATASETS if name in CHOSEN or name in paper]


def corrected_pairs():
    """(dataset with the calibrated twin, the same with the corrected one), both configured."""
    pairs = [(DATASETS[name].uncorrected, name) for name in CHOSEN]
    return [pair for pair in pairs if pair[0] in CHOSEN]
