"""Tests one model of every kind that docs/MODELS.md lists: its answers beside the library's own `predict`.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model_kinds

KINDS=all tests every kind, and without it five are tested. Kinds of the list REFUSED are not imported with --check: their
refusals are tested.
"""

import os
import subprocess
import tempfile
import unittest
from dataclasses import dataclass, field

import numpy
from imported import MISSING, SCALE, Imported

if MISSING is None:
    import catboost
    import lightgbm
    import onnxmltools
    import skl2onnx
    import xgboost
    from onnx import TensorProto, helper, numpy_helper
    from onnxmltools.convert.common.data_types import FloatTensorType as LightFloat
    from skl2onnx.common.data_types import DoubleTensorType, FloatTensorType
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


@dataclass
class Kind:
    """How a kind of model is made, how it is saved, and which part of its answers must be those of the library."""

    make: object
    agree: float
    double: bool = False
    gemm: bool = False
    # Samples show how large the values within a network are.
    check: bool = False
    options: dict = field(default_factory=dict)
    arguments: tuple = ()


def kinds():
    """Returns all kinds by their names."""
    one = {"random_state": 1, "n_jobs": 1}
    light = {"n_estimators": 10, "n_jobs": 1, "verbose": -1}
    cat = {"iterations": 10, "depth": 4, "thread_count": 1, "allow_writing_files": False, "verbose": False}
    svc = {"kernel": "linear", "random_state": 1}
    raw = {LinearSVC: {"raw_scores": True}}

    def logistic(**options):
        return linear_model.LogisticRegression(max_iter=100, **options)

    def behind(*steps):
        """Returns what makes a pipeline of these steps."""
        return lambda: make_pipeline(*steps)

    return {
        # Trees.
        "DecisionTree": Kind(lambda: DecisionTreeClassifier(random_state=1), EXACT),
        "RandomForest": Kind(lambda: ensemble.RandomForestClassifier(30, **one), EXACT),
        "ExtraTrees": Kind(lambda: ensemble.ExtraTreesClassifier(30, **one), EXACT),
        "StandardScaler, ExtraTrees": Kind(behind(StandardScaler(), ensemble.ExtraTreesClassifier(30, **one)), 0.999),
        "XGBoost": Kind(lambda: xgboost.XGBClassifier(n_estimators=10, n_jobs=1), EXACT),
        "XGBoost's forest": Kind(lambda: xgboost.XGBRFClassifier(n_estimators=10, max_depth=6, n_jobs=1), EXACT),
        "LightGBM": Kind(lambda: lightgbm.LGBMClassifier(**light), EXACT),
        "CatBoost": Kind(lambda: catboost.CatBoostClassifier(**cat), EXACT),
        "GradientBoosting": Kind(
            lambda: ensemble.GradientBoostingClassifier(n_estimators=3, max_features=30, random_state=1), EXACT
        ),
        "HistGradientBoosting": Kind(lambda: ensemble.HistGradientBoostingClassifier(max_iter=5, max_bins=32), EXACT),
        "Bagging": Kind(lambda: ensemble.BaggingClassifier(n_estimators=10, **one), EXACT),
        # Weighted sums.
        "LDA": Kind(LinearDiscriminantAnalysis, LINEAR),
        "LDA, float64": Kind(LinearDiscriminantAnalysis, LINEAR, double=True),
        "LDA, lsqr, shrinkage": Kind(lambda: LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), LINEAR),
        "LDA, lsqr, shrinkage, float64": Kind(
            lambda: LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), LINEAR, double=True
        ),
        "SVC": Kind(lambda: SVC(**svc), LINEAR),
        "SVC, int8": Kind(lambda: SVC(**svc), 0.98, arguments=("--weights", "int8")),
        "SVC with probabilities": Kind(lambda: SVC(**svc, C=0.1, probability=True), LINEAR),
        "StandardScaler, SVC": Kind(behind(StandardScaler(), SVC(**svc)), LINEAR),
        "LinearSVC": Kind(lambda: LinearSVC(max_iter=200, random_state=1), LINEAR),
        "StandardScaler, LinearSVC": Kind(
            behind(StandardScaler(), LinearSVC(max_iter=50, random_state=1)), LINEAR, options=raw
        ),
        "LogisticRegression": Kind(logistic, LINEAR),
        "LogisticRegression, float64": Kind(logistic, LINEAR, double=True),
        "PyTorch's Linear": Kind(logistic, LINEAR, gemm=True),
        "OneVsRest, LogisticRegression": Kind(lambda: OneVsRestClassifier(logistic()), LINEAR),
        "Ridge": Kind(linear_model.RidgeClassifier, LINEAR),
        "three scalers, Ridge": Kind(
            behind(RobustScaler(), MaxAbsScaler(), StandardScaler(with_mean=False), linear_model.RidgeClassifier()),
            LINEAR,
        ),
        "SGD": Kind(lambda: linear_model.SGDClassifier(random_state=1), LINEAR),
        "Perceptron": Kind(lambda: linear_model.Perceptron(random_state=1), LINEAR),
        "PCA, LogisticRegression": Kind(behind(PCA(40, random_state=1), logistic()), LINEAR),
        "MinMaxScaler, LogisticRegression": Kind(behind(MinMaxScaler(), logistic()), LINEAR),
        "SelectKBest, LogisticRegression": Kind(behind(SelectKBest(k=200), logistic()), LINEAR),
        "VarianceThreshold, RandomForest": Kind(
            behind(VarianceThreshold(1e-3), ensemble.RandomForestClassifier(30, **one)), EXACT
        ),
        "imputer, RandomForest": Kind(behind(SimpleImputer(), ensemble.RandomForestClassifier(30, **one)), EXACT),
        "imputer, LogisticRegression": Kind(behind(SimpleImputer(), logistic()), LINEAR),
        # Networks.
        "MLP": Kind(lambda: MLPClassifier((32,), max_iter=60, random_state=1), LINEAR, check=True),
        "StandardScaler, MLP of two layers": Kind(
            behind(StandardScaler(), MLPClassifier((40, 20), max_iter=60, random_state=1)), LINEAR, check=True
        ),
    }


FEW = ("RandomForest", "XGBoost", "LightGBM", "SVC", "Ridge")
REFUSED = {"LDA, lsqr, shrinkage": "has float32 numbers, whose rounding changes about"}


def gemm(model):
    """Returns the weights of a linear model as torch.onnx writes a Linear with argmax behind it."""
    numbers = {"weight": model.coef_, "bias": model.intercept_}
    return helper.make_model(
        helper.make_graph(
            [
                helper.make_node("Gemm", ["X", "weight", "bias"], ["scores"], transB=1),
                helper.make_node("ArgMax", ["scores"], ["label"], axis=1, keepdims=0),
            ],
            "linear",
            [helper.make_tensor_value_info("X", TensorProto.FLOAT, [None, 700])],
            [helper.make_tensor_value_info("label", TensorProto.INT64, [None])],
            [numpy_helper.from_array(number.astype(numpy.float32), name) for name, number in numbers.items()],
        ),
        producer_name="pytorch",
    )


class Kinds(Imported):
    """Tests simulated slides, and as many samples between those of different classes."""

    @classmethod
    def data(cls, classes, noise=0):
        """Sets `X`, `y` and `tested`; all kinds have the same."""
        cls.sets = {}
        cls.temporary = cls.enterClassContext(tempfile.TemporaryDirectory())
        for name, sweep in [("train", TRAIN), ("test", TEST)]:
            file = f"{cls.temporary}/{name}"
            with open(f"{file}.toml", "w") as written:
                written.write(sweep)
            subprocess.run(
                [os.environ["WSTAC"], "dataset", f"{file}.toml", "-o", f"{file}.npz"], check=True, capture_output=True
            )
            cls.sets[name] = numpy.load(f"{file}.npz")
        flat = {name: data["X"].reshape(-1, 700) for name, data in cls.sets.items()}
        cls.X, cls.y = flat["train"] * SCALE, cls.sets["train"]["y_specimen"]
        slides = flat["test"].astype(float)
        one, other = cls.random.integers(0, len(slides), (2, len(slides)))
        share = cls.random.random((len(slides), 1))
        between = slides[one] * share + slides[other] * (1 - share) + cls.random.normal(0, 20, slides.shape)
        cls.tested = numpy.concatenate([flat["test"], numpy.rint(between).astype(numpy.int16)])

    def saved(self, kind, model):
        """Writes a model as its library does. Returns the file's path."""
        path = self.path / "kind"
        if isinstance(model, xgboost.XGBClassifier):
            path = path.with_suffix(".json")
            model.save_model(path)
        elif isinstance(model, catboost.CatBoostClassifier):
            model.save_model(path, format="onnx")
        elif isinstance(model, lightgbm.LGBMClassifier):
            made = onnxmltools.convert_lightgbm(model, initial_types=[("X", LightFloat([None, 700]))])
            path.write_bytes(made.SerializeToString())
        elif kind.gemm:
            path.write_bytes(gemm(model).SerializeToString())
        else:
            types = DoubleTensorType if kind.double else FloatTensorType
            made = skl2onnx.convert_sklearn(model, initial_types=[("X", types([None, 700]))], options=kind.options)
            path.write_bytes(made.SerializeToString())
        return path

    def check(self, name, kind):
        model, names, arguments = kind.make(), numpy.unique(self.y), list(kind.arguments)
        if isinstance(model, xgboost.XGBClassifier):
            expected = names[model.fit(self.X, numpy.searchsorted(names, self.y)).predict(self.tested * SCALE)]
        else:
            expected = numpy.asarray(model.fit(self.X, self.y).predict(self.tested * SCALE)).ravel().astype(str)
        if kind.gemm or isinstance(model, xgboost.XGBClassifier):
            arguments += ["--labels", ",".join(names)]
        file = self.saved(kind, model)
        checks = ["--check", f"{self.temporary}/test.npz"]
        if kind.check:
            arguments += checks
        if says := REFUSED.get(name):
            self.refused(file, says, options=[*arguments, *checks])
            print(f"{name}: refused ({says} …)", flush=True)
            return
        answers, said = self.answers(file, *arguments, samples=self.tested)
        same = answers == expected
        right = (answers[: len(same) // 2] == self.sets["test"]["y_specimen"]).mean()
        print(
            f"{name}: {100 * same.mean():.2f} % of {len(same)} alike, {100 * right:.1f} % of slides right; {said}",
            flush=True,
        )
        self.assertGreaterEqual(same.mean(), kind.agree)
        if kind.agree == EXACT:
            said = self.imported(file, *arguments, *checks)[1]
            self.assertIn("rounding changes 0 of 1000 answers", said)
            self.assertIn(f"; {round(1000 * right)} of 1000 answers are right", said)

    def test_kinds(self):
        table = kinds()
        self.assertLessEqual(len(table), 40)
        self.assertEqual(set(REFUSED) - set(table), set())
        for name in table if os.environ.get("KINDS") == "all" else FEW:
            with self.subTest(kind=name):
                self.check(name, table[name])


if __name__ == "__main__":
    unittest.main()
