"""`wstac model`: imported models answer as the trained ones do. Skipped without scikit-learn, xgboost and skl2onnx.

    WSTAC=$(../../ci/wstac) $(../../ci/python train) -m unittest -v test_model
"""

import json
import os
import re
import subprocess
import tempfile
import unittest
import warnings
from pathlib import Path

import numpy

try:
    import skl2onnx
    import xgboost
    from skl2onnx.common.data_types import FloatTensorType
    from sklearn.ensemble import ExtraTreesClassifier, RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC, LinearSVC
    from sklearn.tree import DecisionTreeClassifier

    MISSING = None
except ImportError as error:
    MISSING = str(error)

LABELS = numpy.array(["Fla0", "Saw2", "Saw3", "Saw4", "Sin2", "Sin3", "Sin4", "Tri2", "Tri3", "Tri4"])
SCALE = 1 / 2048
LOW, HIGH = -9471, 3296
SAMPLES = 2000


@unittest.skipIf(MISSING, f"needs requirements-train.txt: {MISSING}")
@unittest.skipUnless("WSTAC" in os.environ, "needs WSTAC, the path that ci/wstac prints")
class Agreement(unittest.TestCase):
    """Each model on samples of its domain, half of them with values exactly on its thresholds or beside them."""

    @classmethod
    def setUpClass(cls):
        warnings.filterwarnings("ignore")
        cls.random = numpy.random.default_rng(7)
        cls.y = cls.random.integers(0, 10, 400)
        centres = cls.random.normal(0, 900, (10, 700))
        noise = cls.random.normal(0, 2500, (400, 700))
        cls.integers = numpy.clip(-4000 + centres[cls.y] + noise, LOW, HIGH).astype(numpy.int16)
        cls.X = cls.integers * SCALE
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = Path(cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def wstac(self, *arguments, code=0):
        command = [os.environ["WSTAC"], "model", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def answers(self, file, *options, samples, truth=None):
        """What the imported model says of samples, and what importing said."""
        model, data = self.path / "model.wsm", self.path / "data.npz"
        said = self.wstac("import", file, "-o", model, "--force", *options).stderr
        first = model.read_bytes()
        self.wstac("import", file, "-o", model, "--force", *options)
        self.assertEqual(model.read_bytes(), first)
        arrays = {"X": samples} if truth is None else {"X": samples, "y": truth}
        save = numpy.savez if truth is None else numpy.savez_compressed
        save(data, **arrays)
        self.wstac("inspect", model)
        inspected = json.loads(self.wstac("inspect", model, "--json").stdout)
        self.assertEqual(inspected["bytes"], len(first))
        found = json.loads(self.wstac("eval", model, data, "--json").stdout)
        self.assertEqual(found["n"], len(samples))
        answers = numpy.array(found["predictions"])
        if truth is None:
            self.assertIsNone(found["accuracy"])
        else:
            self.assertAlmostEqual(found["accuracy"], (answers == truth.astype(str)).mean())
        return answers, said

    def onnx(self, model, inputs=700):
        path = self.path / "model.onnx"
        made = skl2onnx.convert_sklearn(model, initial_types=[("X", FloatTensorType([None, inputs]))])
        path.write_bytes(made.SerializeToString())
        return path

    def samples(self, thresholds=()):
        """Samples of the domain; the second half has values on thresholds, one unit below and above."""
        samples = self.integers[self.random.integers(0, 400, 2 * SAMPLES)].copy()
        noise = self.random.normal(0, 1500, samples.shape)
        samples[:] = numpy.clip(samples + noise, LOW, HIGH)
        by_input = {}
        for feature, threshold in thresholds:
            by_input.setdefault(int(feature), []).append(int(numpy.floor(threshold / SCALE)))
        for feature, values in by_input.items():
            values = self.random.choice(values, SAMPLES) + self.random.integers(-1, 2, SAMPLES)
            samples[SAMPLES:, feature] = numpy.clip(values, -32768, 32767)
        return samples if thresholds else samples[:SAMPLES]

    def report(self, name, same, left_out=0):
        left = f", {left_out} left out" if left_out else ""
        print(f"{name}: {same.sum()} of {len(same)} alike{left}")
        self.assertTrue(same.all())

    def forest(self, name, model, y, inputs=700):
        model.fit(self.X[:, :inputs] if inputs == 700 else self.first(self.X, inputs), y)
        trees = [tree.tree_ for tree in getattr(model, "estimators_", [model])]
        splits = [(f, t) for tree in trees for f, t in zip(tree.feature, tree.threshold) if f >= 0]
        if inputs != 700:
            frames = inputs // 10
            splits = [(f // frames * 70 + f % frames, t) for f, t in splits]
        samples = self.samples(splits)
        seen = samples * SCALE if inputs == 700 else self.first(samples * SCALE, inputs)
        answers, said = self.answers(self.onnx(model, inputs), samples=samples, truth=model.predict(seen))
        votes = model.predict_proba(seen)
        best = numpy.sort(votes, axis=1)
        # Where two classes have the same votes, scikit-learn's own rounding may decide: one of them it must be.
        tied = best[:, -1] - best[:, -2] < 1e-7
        same = answers == model.predict(seen).astype(str)
        print(f"{name}: {same.sum()} of {len(same)} alike in all;{said.strip().rpartition(';')[2]}")
        self.report(f"{name}, without ties", same[~tied], tied.sum())
        numbers = numpy.searchsorted(model.classes_.astype(str), answers)
        self.assertTrue((best[:, -1] - votes[numpy.arange(len(votes)), numbers] < 1e-7).all())

    @staticmethod
    def first(X, inputs):
        return X.reshape(-1, 10, 70)[:, :, : inputs // 10].reshape(-1, inputs)

    def test_forests(self):
        names, two = LABELS[self.y], (self.y > 4).astype(int)
        self.forest("forest", RandomForestClassifier(100, random_state=1), names)
        self.forest("forest, max_depth 6", RandomForestClassifier(50, max_depth=6, random_state=1), names)
        self.forest("forest, ccp_alpha", RandomForestClassifier(50, ccp_alpha=0.01, random_state=1), names)
        self.forest("forest of two classes", RandomForestClassifier(31, max_depth=5, random_state=1), two)
        self.forest("forest of two names", RandomForestClassifier(31, random_state=1), LABELS[two])
        self.forest("extra trees", ExtraTreesClassifier(50, random_state=1), names)
        self.forest("decision tree", DecisionTreeClassifier(random_state=1), self.y)
        self.forest("forest of 20 frames", RandomForestClassifier(30, random_state=1), names, inputs=200)

    def boosted(self, name, model, y, labels=None, **fit):
        model.fit(self.X, y, **fit)
        saved = json.loads(model.get_booster().save_raw("json"))
        splits = []
        for tree in saved["learner"]["gradient_booster"]["model"]["trees"]:
            nodes = zip(tree["left_children"], tree["split_indices"], tree["split_conditions"])
            splits += [(feature, split) for left, feature, split in nodes if left >= 0]
        samples = self.samples(splits)
        expected = model.predict(samples * SCALE)
        expected = expected.astype(str) if labels is None else numpy.array(labels)[expected]
        options = [] if labels is None else ["--labels", ",".join(labels)]
        for ending in ["json", "ubj"]:
            path = self.path / f"model.{ending}"
            model.save_model(path)
            # The kind of file shows in what it holds.
            file = path.rename(self.path / "model")
            answers, _ = self.answers(file, *options, samples=samples, truth=expected)
            self.report(f"{name}, {ending}", answers == expected)
        answers, said = self.answers(file, *options, "--leaves", "int16", samples=samples)
        print(f"  with int16 leaves: {(answers == expected).sum()} of {len(answers)} alike;{said.rpartition(';')[2].strip()}")

    def test_boosted_trees(self):
        two = (self.y > 4).astype(int)
        many = xgboost.XGBClassifier(n_estimators=30, max_depth=4)
        self.boosted("XGBoost", many, self.y, LABELS)
        self.boosted("XGBoost, two classes", xgboost.XGBClassifier(n_estimators=40, max_depth=3), two)
        self.boosted("XGBoost, base score", xgboost.XGBClassifier(n_estimators=5, base_score=0.3), two)
        rounds = xgboost.XGBClassifier(n_estimators=60, max_depth=3, early_stopping_rounds=2)
        self.boosted("XGBoost, stopped early", rounds, self.y, eval_set=[(self.X[:100], self.y[::-1][:100])])
        parallel = xgboost.XGBClassifier(n_estimators=4, num_parallel_tree=3, subsample=0.5, colsample_bynode=0.5)
        self.boosted("XGBoost, parallel trees", parallel, self.y)
        pruned = xgboost.XGBClassifier(n_estimators=10, gamma=5, tree_method="exact")
        self.boosted("XGBoost, pruned", pruned, self.y)

    def linear(self, name, model, y):
        model.fit(self.X, y)
        # Between samples of different classes, so that some are close to where the answer changes.
        first, second = self.samples(), self.samples()
        share = self.random.random((SAMPLES, 1))
        samples = (share * first + (1 - share) * second).astype(numpy.int16)
        expected = model.predict(samples * SCALE).astype(str)
        last = model[-1] if hasattr(model, "steps") else model
        if isinstance(last, SVC):
            last.decision_function_shape = "ovo"
        scores = model.decision_function(samples * SCALE)
        for weights in ["int16", "int8"]:
            answers, said = self.answers(self.onnx(model), "--weights", weights, samples=samples)
            bound = float(re.search(r"off by (\S+) at most", said)[1])
            # Float32 of ONNX adds to the bound: weights to 24 bits.
            bound += 1e-5 * numpy.abs(scores).max()
            if scores.ndim == 1 or isinstance(last, SVC):
                near = numpy.abs(scores.reshape(len(samples), -1)).min(axis=1) <= bound
            else:
                best = numpy.sort(scores, axis=1)
                near = best[:, -1] - best[:, -2] <= 2 * bound
            same = answers == expected
            print(f"{name}, {weights}: {same.sum()} of {len(same)} alike in all")
            self.report(f"{name}, {weights}, outside the bound {bound:.1e}", same[~near], near.sum())

    def test_linear_models(self):
        names, two = LABELS[self.y], (self.y > 4).astype(int)
        for y, kind in [(names, "ten classes"), (two, "two classes")]:
            self.linear(f"LinearSVC, {kind}", LinearSVC(random_state=1), y)
            self.linear(f"logistic regression, {kind}", LogisticRegression(max_iter=300), y)
            self.linear(f"scaled logistic regression, {kind}", make_pipeline(StandardScaler(), LogisticRegression()), y)
            self.linear(f"scaled SVC, {kind}", make_pipeline(StandardScaler(), SVC(kernel="linear")), y)
            self.linear(f"SVC, {kind}", SVC(kernel="linear", C=0.01), y)

    def test_what_is_not_understood_is_refused_by_name(self):
        output = self.path / "refused.wsm"
        two = (self.y > 4).astype(int)
        svc = SVC(kernel="rbf").fit(self.X, two)
        said = self.wstac("import", self.onnx(svc), "-o", output, code=1).stderr
        self.assertIn("kernel_type RBF", said)
        for name, model, says in [
            ("dart", xgboost.XGBClassifier(n_estimators=2, booster="dart"), '"dart"'),
            ("linear", xgboost.XGBClassifier(n_estimators=2, booster="gblinear"), '"gblinear"'),
            ("regression", xgboost.XGBRegressor(n_estimators=2), '"reg:squarederror"'),
        ]:
            path = self.path / f"{name}.json"
            model.fit(self.X, two).save_model(path)
            said = self.wstac("import", path, "-o", output, code=1).stderr
            self.assertIn(says, said)
            self.assertIn(str(path), said)
        self.assertFalse(output.exists())


if __name__ == "__main__":
    unittest.main()
