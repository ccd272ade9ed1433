"""Every constant of the specification that more than one file needs."""

ROWS = COLUMNS = 5
TAXELS = ROWS * COLUMNS
FEATURES = ROWS + COLUMNS

UNIT = 2048
"""Feature units per 1.0 of natural logarithm (11 fraction bits)."""

FEATURE_MIN = -32768
"""Saturation of a feature: -16 in natural logarithm."""

SAMPLE_FRAMES = 70
"""l, the sample length (*paper*)."""

DARK_FRAMES = 5
"""Dark frames behind a touch after which it has ended."""

SLOW_DARK_FRAMES = 20
"""Dark frames behind an event without a reliable answer after which light is another touch."""

SHORT_GAP = SAMPLE_FRAMES // 10
"""Longest run of lost feature frames that is filled and treated as ordinary."""

BASELINE_WINDOWS = 5
"""The baseline is this many windows long."""

BINNING_ABOVE_FPS = 45
NOMINAL_FPS = 30
