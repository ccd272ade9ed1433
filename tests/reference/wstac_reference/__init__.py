"""Independent reference of WSTac's arithmetic (sums, features, trigger, speed, direction).

It was written from the specification, and never from the product's own code. If the two agree, two independent readings
agree. Integers are exact Python or numpy integers, and real numbers are float64. Being clearly right matters more than
speed.

Each file has one job: ``formats`` (the meaning of bytes), ``layout`` (the places of taxels), ``green`` (frame to 25
sums), ``features`` (sums to 10 fixed-point logs), ``binning`` (high frame rates and lost frames), ``trigger``,
``speed``, ``direction``, ``pipeline`` (all of it in order), ``y4m``, ``rng``.

Docstrings write *paper* for a published number, and *decided* for a choice if the published description is silent.
"""
