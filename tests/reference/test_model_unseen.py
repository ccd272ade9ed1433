"""Tests `wstac model` with models that nobody chose: random hyperparameters, classes, labels and frames.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model_unseen

Environment: UNSEEN_SEED (1) is the first model's seed, and UNSEEN_COUNT (16) is the number of models. A failure names
its seed.
"""

import os
import unittest

import numpy
from imported import LABELS, MISSING, Imported

if MISSING is None:
    import xgboost
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.ensemble import ExtraTreesClassifier, RandomForestClassifier
    from sklearn.linear_model import LogisticRegression, RidgeClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC, LinearSVC, NuSVC
    from sklearn.tree import DecisionTreeClassifier, ExtraTreeClassifier

FIRST = int(os.environ.get("UNSEEN_SEED", "1"))
COUNT = int(os.environ.get("UNSEEN_COUNT", "16"))
SAMPLES = 600


class Unseen(Imported):
    """Tests one model for each seed."""

    little = 0

    def proves(self, name, enough):
        """Random models may be so poor that nearly all votes are tied except for rounding. Few may be."""
        if not enough:
            print(f"{name}: shows little, most samples are within the bound")
            type(self).little += 1

    def labels(self):
        """Returns the classes as names, numbers, or numbers that are not positions."""
        kind = self.random.integers(4)
        if kind == 0:
            return LABELS[self.y] if self.y.max() < 10 else numpy.char.add("klass-µ", self.y.astype(str))
        return [self.y, self.y * 7 - 30, numpy.char.add("ä b,", self.y.astype(str))][kind - 1]

    def choose(self, **choices):
        """Returns one of each, at random."""
        return {name: values[self.random.integers(len(values))] for name, values in choices.items()}

    def draw_forest(self, inputs):
        kind = [RandomForestClassifier, ExtraTreesClassifier, DecisionTreeClassifier, ExtraTreeClassifier][
            self.random.integers(4)
        ]
        options = self.choose(
            max_depth=[None, None, 1, 2, 4, 9, 40],
            max_features=["sqrt", "log2", 0.3, 1, None],
            min_samples_leaf=[1, 1, 2, 5, 30],
            max_leaf_nodes=[None, None, 2, 17, 100],
            ccp_alpha=[0.0, 0.0, 0.003, 0.02],
            criterion=["gini", "entropy"],
            class_weight=[None, None, "balanced"],
        )
        if kind in (RandomForestClassifier, ExtraTreesClassifier):
            options |= self.choose(n_estimators=[1, 2, 3, 10, 31, 64], bootstrap=[True, False], n_jobs=[1])
            if options["bootstrap"]:
                options |= self.choose(max_samples=[None, 0.2, 0.7], class_weight=[None, "balanced_subsample"])
        model = kind(random_state=int(self.random.integers(1 << 30)), **options)
        zipmap = self.choose(zipmap=[True, False])
        self.forest(f"{model}", model, self.labels(), inputs=inputs, count=SAMPLES, options=zipmap)

    def draw_boosted(self, inputs):
        options = self.choose(
            n_estimators=[1, 3, 10, 20],
            max_depth=[0, 1, 2, 4, 7],
            max_leaves=[0, 0, 5],
            grow_policy=["depthwise", "lossguide"],
            learning_rate=[0.05, 0.3, 1.0],
            subsample=[1.0, 0.5],
            colsample_bytree=[1.0, 0.1],
            num_parallel_tree=[1, 1, 3],
            gamma=[0.0, 0.0, 2.0, 30.0],
            reg_lambda=[0.0, 1.0, 10.0],
            reg_alpha=[0.0, 1.0],
            min_child_weight=[0, 1, 5],
            base_score=[None, None, 0.5, 0.2],
            max_delta_step=[0, 1],
            tree_method=["hist", "exact", "approx"],
        )
        if options["tree_method"] == "exact":
            options["grow_policy"] = "depthwise"
            options["max_leaves"] = 0
        if options["max_depth"] == 0 and options["max_leaves"] == 0:
            options["max_depth"] = 3
        model = xgboost.XGBClassifier(random_state=int(self.random.integers(1 << 30)), **options)
        labels = None if self.random.integers(2) else [f"klass {at}" for at in range(self.y.max() + 1)]
        self.boosted(f"{options}", model, self.y, labels, inputs=inputs, count=SAMPLES)

    def draw_linear(self):
        at = self.random.integers(7)
        C = float(10.0 ** self.random.integers(-3, 2))
        model = [
            lambda: LinearSVC(C=C, random_state=1),
            lambda: LogisticRegression(C=C, max_iter=200),
            lambda: LogisticRegression(C=C, fit_intercept=False, max_iter=200),
            lambda: RidgeClassifier(alpha=1 / C),
            lambda: LinearDiscriminantAnalysis(solver="lsqr", shrinkage=0.5),
            lambda: SVC(kernel="linear", C=C),
            lambda: NuSVC(kernel="linear", nu=0.1),
        ][at]()
        # skl2onnx does not convert a LinearSVC that is a pipeline's last step.
        if self.random.integers(2) and not isinstance(model, LinearSVC):
            steps = self.choose(with_mean=[True, False], with_std=[True, False])
            model = make_pipeline(StandardScaler(**steps), model)
        self.linear(f"{model}", model, self.labels(), count=SAMPLES)

    def test_models_by_chance(self):
        for seed in range(FIRST, FIRST + COUNT):
            with self.subTest(seed=seed):
                self.chance(seed)
                self.data(int(self.random.choice([2, 2, 3, 4, 10, 10, 17])), noise=self.random.choice([800, 2500, 6000]))
                inputs = int(self.random.choice([700, 700, 10, 350]))
                kind = self.random.integers(7)
                print(f"seed {seed}: ", end="")
                if kind < 3:
                    self.draw_forest(inputs)
                elif kind < 5:
                    self.draw_boosted(inputs)
                else:
                    self.draw_linear()
        # About one of ten models is so poor.
        self.assertLessEqual(self.little, max(1, COUNT // 2))


if __name__ == "__main__":
    unittest.main()
