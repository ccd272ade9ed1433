"""Tests one model of every kind that docs/MODELS.md lists: its answers beside the library's own `predict`.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model_kinds

KINDS=all tests every kind, and without it five are tested. Kinds of the list REFUSED are not imported with --check: their
refusals are tested.
"""

import os
import subprocess
import unittest
from dataclasses import dataclass, field

import numpy
from imported import LABELS, MISSING, SAMPLES, SCALE, Imported

if MISSING is None:
    import catboost
    import lightgbm
    import onnx
    import onnxmltools
    import xgboost
    from onnxmltools.convert.common.data_types import FloatTensorType
    from sklearn import ensemble, linear_model
    from sklearn.decomposition import PCA
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.feature_selection import SelectKBest, VarianceThreshold
    from sklearn.impute import SimpleImputer
    from sklearn.multiclass import OneVsRestClassifier
    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MaxAbsScaler, MinMaxScaler, RobustScaler, StandardScaler
    from sklearn.svm import SVC, LinearSVC
    from sklearn.tree import DecisionTreeClassifier

EXACT, LINEAR = 1.0, 0.995
TRAIN = "slides = 60\nspeeds = [100, 150, 200]\ndirections = [0, 90]\n"
TEST = TRAIN.replace("60", "100") + "seed = 100001\n"
# Half of the samples of trees have their inputs on thresholds.
ON_THRESHOLDS = 1000


@dataclass
class Kind:
    """How a kind of model is made, how it is saved, and which part of its answers must be those of the library."""

    make: object
    agree: float = EXACT
    # For two classes; `None` makes the same.
    two: object = None
    # Of skl2onnx, or the network that writes it.
    options: dict = field(default_factory=dict)
    writer: str = ""

    @property
    def is_network(self):
        """Returns `True` if samples must show how large the values within are."""
        return self.writer == "" and "MLP" in str(self.make())


def kinds():
    """Returns all kinds by their names."""
    one = {"random_state": 1, "n_jobs": 1}
    light = {"n_estimators": 10, "n_jobs": 1, "verbose": -1}
    cat = {"iterations": 10, "thread_count": 1, "allow_writing_files": False, "verbose": False}
    svc = {"kernel": "linear", "random_state": 1}
    double, lsqr = {"real": "Double"}, {"solver": "lsqr", "shrinkage": "auto"}

    def logistic():
        return linear_model.LogisticRegression(max_iter=100)

    def gradient(**options):
        return ensemble.GradientBoostingClassifier(n_estimators=3, max_features=30, random_state=1, **options)

    def hist():
        return ensemble.HistGradientBoostingClassifier(max_iter=5, max_bins=32, random_state=1)

    def behind(*steps):
        """Returns what makes a pipeline of these steps."""
        return lambda: make_pipeline(*steps)

    return {
        # Trees. Of two classes, an even number of them would tie.
        "DecisionTree": Kind(lambda: DecisionTreeClassifier(random_state=1)),
        "RandomForest": Kind(lambda: ensemble.RandomForestClassifier(31, **one)),
        "ExtraTrees": Kind(lambda: ensemble.ExtraTreesClassifier(31, **one)),
        "StandardScaler, ExtraTrees": Kind(behind(StandardScaler(), ensemble.ExtraTreesClassifier(31, **one))),
        "XGBoost": Kind(lambda: xgboost.XGBClassifier(n_estimators=10, n_jobs=1)),
        "XGBoost's forest": Kind(lambda: xgboost.XGBRFClassifier(n_estimators=10, max_depth=6, n_jobs=1)),
        "LightGBM": Kind(lambda: lightgbm.LGBMClassifier(**light)),
        "LightGBM, dart": Kind(
            lambda: lightgbm.LGBMClassifier(**light, boosting_type="dart", objective="multiclassova", num_class=10),
            two=lambda: lightgbm.LGBMClassifier(**light, boosting_type="dart"),
        ),
        "CatBoost": Kind(lambda: catboost.CatBoostClassifier(**cat, depth=4)),
        "CatBoost from the mean": Kind(
            lambda: catboost.CatBoostClassifier(**cat, depth=3),
            two=lambda: catboost.CatBoostClassifier(**cat, depth=3, boost_from_average=True),
        ),
        "GradientBoosting": Kind(gradient, two=lambda: gradient(init="zero")),
        "HistGradientBoosting": Kind(hist),
        "Bagging": Kind(lambda: ensemble.BaggingClassifier(n_estimators=11, **one)),
        "Bagging, half of the inputs": Kind(lambda: ensemble.BaggingClassifier(n_estimators=11, max_features=0.5, **one)),
        "VarianceThreshold, imputer, HistGradientBoosting": Kind(behind(VarianceThreshold(1e-3), SimpleImputer(), hist())),
        "MinMaxScaler, GradientBoosting": Kind(behind(MinMaxScaler(), gradient())),
        "SelectKBest, StandardScaler, GradientBoosting": Kind(behind(SelectKBest(k=50), StandardScaler(), gradient())),
        # Weighted sums.
        "LDA": Kind(LinearDiscriminantAnalysis, LINEAR),
        "LDA, lsqr, shrinkage": Kind(lambda: LinearDiscriminantAnalysis(**lsqr), LINEAR),
        "LDA, lsqr, shrinkage, float64": Kind(lambda: LinearDiscriminantAnalysis(**lsqr), LINEAR, options=double),
        "SVC": Kind(lambda: SVC(**svc), LINEAR),
        "SVC with probabilities": Kind(lambda: SVC(**svc, C=0.1, probability=True), LINEAR),
        "StandardScaler, SVC": Kind(behind(StandardScaler(), SVC(**svc)), LINEAR),
        "StandardScaler without a mean, SVC": Kind(behind(StandardScaler(with_mean=False), SVC(**svc)), LINEAR),
        "StandardScaler, whitened PCA, SVC": Kind(
            behind(StandardScaler(), PCA(20, whiten=True, random_state=1), SVC(**svc)), LINEAR
        ),
        "LinearSVC": Kind(
            lambda: LinearSVC(max_iter=200, random_state=1),
            LINEAR,
            two=lambda: make_pipeline(StandardScaler(with_mean=False), logistic()),
        ),
        "StandardScaler, LinearSVC": Kind(
            behind(StandardScaler(), LinearSVC(max_iter=50, random_state=1)),
            LINEAR,
            options={"options": {LinearSVC: {"raw_scores": True}}},
            two=lambda: make_pipeline(StandardScaler(with_mean=False), LinearSVC(max_iter=50, random_state=1)),
        ),
        "LogisticRegression, float64": Kind(logistic, LINEAR, options=double),
        "PyTorch's Linear": Kind(logistic, LINEAR, writer="torch"),
        "Keras's Dense": Kind(logistic, LINEAR, writer="keras"),
        "OneVsRest": Kind(
            lambda: OneVsRestClassifier(logistic()),
            LINEAR,
            two=lambda: OneVsRestClassifier(LinearSVC(max_iter=200, random_state=1)),
        ),
        "Ridge": Kind(linear_model.RidgeClassifier, LINEAR),
        "four scalers, LogisticRegression": Kind(
            behind(
                MinMaxScaler(),
                RobustScaler(),
                MaxAbsScaler(),
                StandardScaler(with_mean=False),
                logistic(),
            ),
            LINEAR,
        ),
        "SGD": Kind(
            lambda: linear_model.SGDClassifier(random_state=1),
            LINEAR,
            two=lambda: linear_model.SGDClassifier(loss="log_loss", random_state=1),
        ),
        "Perceptron": Kind(lambda: linear_model.Perceptron(random_state=1), LINEAR),
        "PCA, LogisticRegression": Kind(behind(PCA(40, random_state=1), logistic()), LINEAR),
        "SelectKBest, StandardScaler, LogisticRegression": Kind(
            behind(SelectKBest(k=200), StandardScaler(), logistic()), LINEAR
        ),
        "VarianceThreshold, imputer, SVC": Kind(behind(VarianceThreshold(), SimpleImputer(), SVC(**svc)), LINEAR),
        # Networks.
        "MLP": Kind(lambda: MLPClassifier((32,), max_iter=60, random_state=1), LINEAR),
        "StandardScaler, MLP of two layers": Kind(
            behind(StandardScaler(), MLPClassifier((40, 20), max_iter=60, random_state=1)), LINEAR
        ),
    }


FEW = ("RandomForest", "XGBoost", "LightGBM", "SVC", "Ridge")
REFUSED = dict.fromkeys(
    ("LDA, lsqr, shrinkage", "StandardScaler without a mean, SVC"), "has float32 numbers, whose rounding changes about"
)


class Kinds(Imported):
    """Tests ten classes of simulated slides, with as many samples between them, and two classes of random samples."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.sets = {}
        for name, sweep in [("train", TRAIN), ("test", TEST)]:
            file = cls.path / name
            file.with_suffix(".toml").write_text(sweep)
            command = [os.environ["WSTAC"], "dataset", f"{file}.toml", "-o", f"{file}.npz"]
            subprocess.run(command, check=True, capture_output=True)
            cls.sets[name] = numpy.load(f"{file}.npz")

    def thresholds(self, path, steps=()):
        """Returns the features and thresholds of all splits in an ONNX file, before these steps of a pipeline."""
        pairs = []
        for node in onnx.load(path).graph.node:
            lists = {attribute.name: onnx.helper.get_attribute_value(attribute) for attribute in node.attribute}
            splits = zip(lists.get("nodes_modes", []), lists.get("nodes_featureids", []), lists.get("nodes_values", []))
            pairs += [(feature, split) for mode, feature, split in splits if mode != b"LEAF" and numpy.isfinite(split)]
        for step in list(steps)[::-1]:
            if isinstance(step, SimpleImputer):
                continue
            features, splits = numpy.array(pairs).T
            features = features.astype(int)
            scaled = numpy.zeros((len(pairs), len(step.get_feature_names_out())))
            scaled[numpy.arange(len(pairs)), features] = splits
            if hasattr(step, "get_support"):
                features = step.get_support(indices=True)[features]
            pairs = list(zip(features, step.inverse_transform(scaled)[numpy.arange(len(pairs)), features]))
        return pairs

    @staticmethod
    def in_float32(steps, samples):
        """Returns samples behind steps of a pipeline that compute in float32."""
        X = (samples * SCALE).astype(numpy.float32)
        for step in steps:
            if isinstance(step, MinMaxScaler):
                X = X * step.scale_.astype(numpy.float32) + step.min_.astype(numpy.float32)
            elif isinstance(step, StandardScaler):
                X = (X - step.mean_.astype(numpy.float32)) * (1 / step.scale_).astype(numpy.float32)
            else:
                X = step.transform(X)
        return X

    def saved(self, kind, model):
        """Writes a model as its library does. Returns the file's path."""
        path = self.path / "kind"
        if isinstance(model, xgboost.XGBClassifier):
            path = path.with_suffix(".json")
            model.save_model(path)
        elif isinstance(model, catboost.CatBoostClassifier):
            model.save_model(path, format="onnx")
        elif isinstance(model, lightgbm.LGBMClassifier):
            made = onnxmltools.convert_lightgbm(model, initial_types=[("X", FloatTensorType([None, 700]))])
            path.write_bytes(made.SerializeToString())
        elif kind.writer:
            path = getattr(self, kind.writer)(model)
        else:
            path = self.onnx(model, **kind.options)
        return path

    def network(self, model, nodes, outputs, **constants):
        """Writes a graph of nodes with constants, as other frameworks do."""
        helper = onnx.helper
        names = model.classes_.astype(str).astype(object)
        constants = {name: numpy.float32(list) for name, list in constants.items()} | {"names": names}
        graph = helper.make_graph(
            [helper.make_node(kind, inputs, [output], **options) for kind, inputs, output, options in nodes],
            "network",
            [helper.make_tensor_value_info("X", onnx.TensorProto.FLOAT, ["batch", 700])],
            [helper.make_tensor_value_info(outputs, onnx.TensorProto.STRING, None)],
            [onnx.numpy_helper.from_array(list, name) for name, list in constants.items()],
        )
        path = self.path / "model.onnx"
        path.write_bytes(helper.make_model(graph).SerializeToString())
        return path

    def torch(self, model):
        """Writes the graph of a linear layer of PyTorch and an ArgMax."""
        coef, start = model.coef_, model.intercept_
        if len(coef) == 1:
            coef, start = numpy.vstack([0 * coef, coef]), [0, start[0]]
        nodes = [
            ("Gemm", ["X", "weight", "bias"], "logits", {"transB": 1}),
            ("ArgMax", ["logits"], "class", {"axis": 1, "keepdims": 0}),
            ("Gather", ["names", "class"], "label", {}),
        ]
        return self.network(model, nodes, "label", weight=coef, bias=start)

    def keras(self, model):
        """Writes the graph of a dense layer of Keras; one unit has a Sigmoid, more have a Softmax."""
        nodes = [
            ("MatMul", ["X", "kernel"], "product", {}),
            ("Add", ["product", "start"], "sum", {}),
            ("Sigmoid" if len(model.coef_) == 1 else "Softmax", ["sum"], "scores", {}),
        ]
        return self.network(model, nodes, "scores", kernel=model.coef_.T, start=model.intercept_)

    def compared(self, kind, model, samples, names, *arguments):
        """Imports a trained model. Returns its answers, the library's, and the messages of import.

        Half of the samples of trees are then on thresholds. ONNX scales in float32, and the library in float64: a scaled
        feature is often exactly between two values of the training, where rounding decides. So trees behind scalers are
        compared with the library's behind scalers of float32. If the library adds float64, nearly equal scores may have either
        answer.
        """
        path = self.saved(kind, model)
        if not hasattr(model, "classes_") or model.classes_.dtype.kind in "iu":
            arguments += ("--labels", ",".join(names))
        steps = model[:-1] if hasattr(model, "steps") else ()
        if kind.agree == EXACT and path.suffix != ".json":
            samples = numpy.concatenate([samples, self.samples(self.thresholds(path, steps), ON_THRESHOLDS)])
        answers, said = self.answers(path, *arguments, samples=samples)
        if kind.agree == EXACT and "scales in float32" in said:
            expected = numpy.asarray(model.predict(samples * SCALE))
            self.assertGreater((answers == expected)[:-ON_THRESHOLDS].mean(), 0.98)
            model, seen = model[-1], self.in_float32(steps, samples)
        else:
            seen = samples * SCALE
        expected = numpy.asarray(model.predict(seen)).ravel()
        expected = names[expected] if expected.dtype.kind in "iu" else expected.astype(str)
        if "adds float64" in said:
            best = numpy.sort(model.predict_proba(seen), axis=1)
            near = best[:, -1] - best[:, -2] < 1e-5
            self.proves(said, near.mean() < 0.01)
            expected[near] = answers[near]
        return answers, expected, said

    def slides(self, name, kind):
        """Compares ten classes."""
        test, y = self.sets["test"], self.sets["train"]["y_specimen"]
        flat = {key: data["X"].reshape(-1, 700) for key, data in self.sets.items()}
        slides = flat["test"].astype(float)
        one, other = self.random.integers(0, len(slides), (2, len(slides)))
        share = self.random.random((len(slides), 1))
        between = slides[one] * share + slides[other] * (1 - share) + self.random.normal(0, 20, slides.shape)
        samples = numpy.concatenate([flat["test"], numpy.rint(between).astype(numpy.int16)])
        model, names = kind.make(), numpy.unique(y)
        has_numbers = isinstance(model, xgboost.XGBClassifier) or kind.writer == "keras"
        model.fit(flat["train"] * SCALE, numpy.searchsorted(names, y) if has_numbers else y)
        check = ("--check", self.path / "test.npz")
        if says := REFUSED.get(name):
            self.refused(self.saved(kind, model), says, options=check)
            print(f"{name}: refused ({says} …)", flush=True)
            return
        arguments = check if kind.is_network or kind.agree == EXACT else ()
        answers, expected, said = self.compared(kind, model, samples, names, *arguments)
        same, right = answers == expected, (answers[: len(slides)] == test["y_specimen"]).mean()
        print(
            f"{name}: {100 * same.mean():.2f} % of {len(same)} alike, {100 * right:.1f} % of slides right; {said}",
            flush=True,
        )
        self.assertGreaterEqual(same.mean(), kind.agree)
        if kind.agree == EXACT:
            self.assertIn("rounding changes 0 of 1000 answers", said)
            self.assertIn(f"; {round(1000 * right)} of 1000 answers are right", said)

    def two(self, name, kind):
        """Compares two classes, of weighted sums outside the bound that import prints."""
        self.data(2)
        model, names = (kind.two or kind.make)(), LABELS[:2]
        if isinstance(model, xgboost.XGBClassifier):
            self.boosted(name, model, self.y, names, endings=("json",), count=ON_THRESHOLDS)
        elif kind.agree == EXACT:
            answers, expected, said = self.compared(kind, model.fit(self.X, names[self.y]), self.near(ON_THRESHOLDS), names)
            self.report(f"{name}: {said}", answers == expected)
        else:
            # What a dense layer gives has no names.
            y = self.y if kind.writer == "keras" else names[self.y]
            self.linear(name, model, y, 2 * SAMPLES, [None], write=lambda model: self.saved(kind, model))

    def test_models_of_taxels(self):
        """Compares models of 1,750 inputs."""
        self.data(10, inputs=1750)
        numpy.savez(self.path / "taxels.npz", X_taxels=self.integers, y_specimen=LABELS[self.y])
        models = [
            (ensemble.RandomForestClassifier(31, random_state=1), EXACT),
            (MLPClassifier((32,), max_iter=20, random_state=1), LINEAR),
        ]
        for model, agree in models if os.environ.get("KINDS") == "all" else models[:1]:
            path = self.onnx(model.fit(self.X, LABELS[self.y]), inputs=1750)
            samples = self.samples(self.thresholds(path) if agree == EXACT else (), ON_THRESHOLDS)
            answers, said = self.answers(path, "--check", self.path / "taxels.npz", samples=samples)
            same = (answers == model.predict(samples * SCALE)).mean()
            print(f"of taxels: {100 * same:.2f} % of {len(samples)} alike; {said}", flush=True)
            self.assertGreaterEqual(same, agree)

    def test_kinds(self):
        table = kinds()
        self.assertLessEqual(len(table), 40)
        self.assertEqual(set(REFUSED) - set(table), set())
        for name in table if os.environ.get("KINDS") == "all" else FEW:
            with self.subTest(kind=name):
                self.slides(name, table[name])
            if name in REFUSED or table[name].is_network:
                continue
            with self.subTest(kind=name, classes=2):
                self.two(f"{name}, two classes", table[name])

    def test_ties_of_two_classes(self):
        """Half of the samples in one leaf are of each class, so its score is exactly 0."""
        X = numpy.zeros((100, 700), numpy.float32)
        X[60:80, 5], X[80:, 5] = 1, -1
        y = LABELS[[0, 1] * 30 + [1] * 20 + [0] * 20]
        samples = numpy.zeros((3, 700), numpy.int16)
        samples[:, 5] = [0, 2048, -2048]
        for model, tie in [
            (ensemble.GradientBoostingClassifier(n_estimators=1, max_depth=2), 1),
            (ensemble.HistGradientBoostingClassifier(max_iter=1), 0),
            (lightgbm.LGBMClassifier(n_estimators=1, n_jobs=1, verbose=-1), 0),
        ]:
            path = self.saved(Kind(None), model.fit(X, y))
            expected = list(LABELS[[tie, 1, 0]])
            self.assertEqual(list(model.predict(samples * SCALE)), expected)
            self.assertEqual(list(self.answers(path, samples=samples)[0]), expected)

    def test_forest_of_lightgbm(self):
        """Its converter divides by 100 instead of the number of trees, and reads one of all classes."""
        options = {"boosting_type": "rf", "bagging_freq": 1, "bagging_fraction": 0.6, "verbose": -1}
        model = lightgbm.LGBMClassifier(n_estimators=10, n_jobs=1, **options).fit(self.X, self.y)
        self.refused(self.saved(Kind(None), model), "label_tensor of the classifier is no output")

    def test_forest_that_saw_nan(self):
        X = numpy.where(self.random.random(self.X.shape) < 0.2, numpy.nan, self.X)
        model = ensemble.RandomForestClassifier(31, random_state=1).fit(X, LABELS[self.y])
        path = self.onnx(model)
        thresholds = [split for tree in model.estimators_ for split in tree.tree_.threshold]
        self.assertTrue(numpy.isinf(thresholds).any())
        samples = self.samples(self.thresholds(path), ON_THRESHOLDS)
        answers, said = self.answers(path, samples=samples)
        self.compare_votes("forest trained with NaN", answers, model, samples * SCALE, said)


if __name__ == "__main__":
    unittest.main()
