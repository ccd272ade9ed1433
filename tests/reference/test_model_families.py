"""Tests the import of model families that other libraries write as ONNX, beside the libraries' own `predict`.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model_families
"""

import unittest

import numpy
from imported import LABELS, MISSING, Imported

if MISSING is None:
    import catboost
    import lightgbm
    import onnx
    import onnxmltools
    from onnxmltools.convert.common.data_types import FloatTensorType
    from sklearn.decomposition import PCA
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.ensemble import (
        BaggingClassifier,
        GradientBoostingClassifier,
        HistGradientBoostingClassifier,
        RandomForestClassifier,
    )
    from sklearn.feature_selection import SelectKBest, VarianceThreshold
    from sklearn.impute import SimpleImputer
    from sklearn.linear_model import LogisticRegression, Perceptron, SGDClassifier
    from sklearn.multiclass import OneVsRestClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler, StandardScaler
    from sklearn.svm import SVC, LinearSVC
    from sklearn.tree import DecisionTreeClassifier

# Half of the samples are random, half have their inputs on thresholds.
SAMPLES = 1000


class Families(Imported):
    """Tests models whose ONNX is that of a family."""

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

    def family(self, model):
        """Writes a model as ONNX with the converter for it. Returns the file's path."""
        path = self.path / "model.onnx"
        if isinstance(model, lightgbm.LGBMClassifier):
            made = onnxmltools.convert_lightgbm(model, initial_types=[("X", FloatTensorType([None, 700]))])
            path.write_bytes(made.SerializeToString())
        elif isinstance(model, catboost.CatBoostClassifier):
            model.save_model(path, format="onnx")
        else:
            path = self.onnx(model)
        return path

    def trees(self, name, model, path):
        """Checks that the imported model answers every sample as the library does.

        ONNX scales in float32, and the library in float64. So scalers of float32 are compared, and the library's own are
        only counted: a scaled feature is often exactly between two values of the training, where rounding decides.
        """
        samples = self.samples(self.thresholds(path, model[:-1] if hasattr(model, "steps") else ()), SAMPLES)
        expected = numpy.asarray(model.predict(samples / 2048)).ravel().astype(str)
        answers, said = self.answers(path, samples=samples, truth=expected)
        if "scales in float32" in said:
            print(f"{name}, scaled in float64: {(answers == expected).sum()} of {len(expected)} alike")
            self.assertGreater((answers == expected)[:SAMPLES].mean(), 0.995)
            expected = model[-1].predict(self.in_float32(model[:-1], samples))
        self.report(f"{name}: {said}", answers == expected)

    @staticmethod
    def in_float32(steps, samples):
        """Returns samples behind steps of a pipeline that compute in float32."""
        X = (samples / 2048).astype(numpy.float32)
        for step in steps:
            if isinstance(step, MinMaxScaler):
                X = X * step.scale_.astype(numpy.float32) + step.min_.astype(numpy.float32)
            elif isinstance(step, StandardScaler):
                X = (X - step.mean_.astype(numpy.float32)) * (1 / step.scale_).astype(numpy.float32)
            else:
                X = step.transform(X)
        return X

    def test_boosted_trees(self):
        light = {"n_estimators": 10, "n_jobs": 1, "verbose": -1}
        cat = {"iterations": 10, "thread_count": 1, "allow_writing_files": False, "verbose": False}
        for classes in (2, 10):
            self.data(classes)
            models = [
                GradientBoostingClassifier(n_estimators=5),
                GradientBoostingClassifier(n_estimators=5, init="zero"),
                HistGradientBoostingClassifier(max_iter=10),
                lightgbm.LGBMClassifier(**light),
                lightgbm.LGBMClassifier(**light, boosting_type="dart"),
                catboost.CatBoostClassifier(**cat),
                catboost.CatBoostClassifier(**cat, depth=3, boost_from_average=True if classes == 2 else None),
            ]
            if classes > 2:
                models.append(lightgbm.LGBMClassifier(**light, objective="multiclassova", num_class=classes))
            for model in models:
                name = f"{type(model).__name__} {model.get_params()}"
                with self.subTest(name=name, classes=classes):
                    model.fit(self.X, LABELS[self.y])
                    self.trees(f"{type(model).__name__}, {classes} classes", model, self.family(model))

    def test_trees_behind_steps(self):
        for classes in (2, 10):
            self.data(classes)
            for name, model in {
                "SelectKBest, GradientBoosting": make_pipeline(
                    SelectKBest(k=50), GradientBoostingClassifier(n_estimators=3)
                ),
                "VarianceThreshold, SimpleImputer, LightGBM": make_pipeline(
                    VarianceThreshold(), SimpleImputer(), HistGradientBoostingClassifier(max_iter=5)
                ),
                "MinMaxScaler, GradientBoosting": make_pipeline(
                    MinMaxScaler(), GradientBoostingClassifier(n_estimators=3)
                ),
                "SelectKBest, StandardScaler, GradientBoosting": make_pipeline(
                    SelectKBest(k=50), StandardScaler(), GradientBoostingClassifier(n_estimators=3)
                ),
            }.items():
                with self.subTest(name=name, classes=classes):
                    model.fit(self.X, LABELS[self.y])
                    self.trees(f"{name}, {classes} classes", model, self.onnx(model))

    def test_bagging(self):
        for classes in (2, 10):
            self.data(classes)
            for name, options in {"all": {}, "half of the inputs": {"max_features": 0.5}}.items():
                with self.subTest(name=name, classes=classes):
                    model = BaggingClassifier(DecisionTreeClassifier(max_depth=6), n_estimators=12, **options)
                    model.fit(self.X, LABELS[self.y])
                    path = self.onnx(model)
                    samples = self.samples(self.thresholds(path), SAMPLES)
                    answers, said = self.answers(path, samples=samples)
                    self.compare_votes(f"Bagging, {name}", answers, model, samples / 2048, said)

    def test_linear_models(self):
        for classes in (2, 10):
            self.data(classes)
            for model, options in [
                (SVC(kernel="linear", probability=True), {}),
                (SGDClassifier(), {}),
                (SGDClassifier(loss="log_loss"), {}),
                (Perceptron(), {}),
                (OneVsRestClassifier(LogisticRegression()), {}),
                (OneVsRestClassifier(LinearSVC()), {}),
                (LogisticRegression(), {"real": "Double"}),
                (LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), {"real": "Double"}),
                (make_pipeline(StandardScaler(), LogisticRegression()), {"real": "Double"}),
                (make_pipeline(PCA(20), LogisticRegression()), {}),
                (make_pipeline(StandardScaler(), PCA(20, whiten=True), SVC(kernel="linear")), {}),
                (make_pipeline(MinMaxScaler(), LogisticRegression()), {}),
                (make_pipeline(SelectKBest(k=50), StandardScaler(), LogisticRegression()), {}),
                (make_pipeline(VarianceThreshold(), SimpleImputer(), SVC(kernel="linear")), {}),
                (LogisticRegression(), {"write": self.torch}),
                (LogisticRegression(), {"write": self.keras}),
            ]:
                with self.subTest(model=model, options=options, classes=classes):
                    # What a dense layer gives has no names.
                    y = self.y if options.get("write") == self.keras else LABELS[self.y]
                    self.linear(f"{model}, {classes} classes", model, y, count=2 * SAMPLES, weights=("int16",), **options)

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

    def test_ties_of_two_classes(self):
        """Half of the samples in one leaf are of each class, so its score is exactly 0."""
        X = numpy.zeros((100, 700), numpy.float32)
        X[60:80, 5], X[80:, 5] = 1, -1
        y = LABELS[[0, 1] * 30 + [1] * 20 + [0] * 20]
        samples = numpy.zeros((3, 700), numpy.int16)
        samples[:, 5] = [0, 2048, -2048]
        for model, tie in [
            (GradientBoostingClassifier(n_estimators=1, max_depth=2), 1),
            (HistGradientBoostingClassifier(max_iter=1), 0),
            (lightgbm.LGBMClassifier(n_estimators=1, n_jobs=1, verbose=-1), 0),
        ]:
            model.fit(X, y)
            expected = list(LABELS[[tie, 1, 0]])
            self.assertEqual(list(model.predict(samples / 2048)), expected)
            self.assertEqual(list(self.answers(self.family(model), samples=samples)[0]), expected)

    def test_forest_of_lightgbm(self):
        """Its converter divides by 100 instead of the number of trees, and reads one of all classes."""
        options = {"boosting_type": "rf", "bagging_freq": 1, "bagging_fraction": 0.6, "verbose": -1}
        model = lightgbm.LGBMClassifier(n_estimators=10, n_jobs=1, **options).fit(self.X, self.y)
        self.refused(self.family(model), "label_tensor of the classifier is no output")

    def test_forest_that_saw_nan(self):
        self.data(10)
        X = numpy.where(self.random.random(self.X.shape) < 0.2, numpy.nan, self.X)
        model = RandomForestClassifier(30, random_state=1).fit(X, LABELS[self.y])
        path = self.onnx(model)
        thresholds = [split for tree in model.estimators_ for split in tree.tree_.threshold]
        self.assertTrue(numpy.isinf(thresholds).any())
        samples = self.samples(self.thresholds(path), SAMPLES)
        answers, said = self.answers(path, samples=samples)
        self.compare_votes("forest trained with NaN", answers, model, samples / 2048, said)


if __name__ == "__main__":
    unittest.main()
