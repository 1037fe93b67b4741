"""Which effects explain the data? Stepwise selection over the effect library, by evidence."""
