"""Independent reference of WSTac's arithmetic (sums, features, trigger, speed, direction).

Written from the specification, never from the product's own code: where the two
agree, two independent readings agree. Integers are exact Python or numpy
integers, real numbers are float64. Speed is secondary to being evidently right.

One file a job: ``formats`` (what the bytes mean), ``layout`` (where taxels are),
``green`` (frame to 25 sums), ``features`` (sums to 10 fixed-point logs),
``binning`` (high frame rates and lost frames), ``trigger``, ``speed``,
``direction``, ``pipeline`` (all of it in order), ``y4m``, ``rng``.

Docstrings say *paper* for a published number and *decided* for a choice made
where the published description is silent.
"""
