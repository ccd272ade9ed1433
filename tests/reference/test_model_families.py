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
    from sklearn.ensemble import (
        GradientBoostingClassifier,
        HistGradientBoostingClassifier,
        RandomForestClassifier,
    )

# Half of the samples are random, half have their inputs on thresholds.
SAMPLES = 1000


class Families(Imported):
    """Tests models whose ONNX is that of a family."""

    def thresholds(self, path):
        """Returns the features and thresholds of all splits in an ONNX file."""
        pairs = []
        for node in onnx.load(path).graph.node:
            lists = {attribute.name: onnx.helper.get_attribute_value(attribute) for attribute in node.attribute}
            splits = zip(lists.get("nodes_modes", []), lists.get("nodes_featureids", []), lists.get("nodes_values", []))
            pairs += [(feature, split) for mode, feature, split in splits if mode != b"LEAF" and numpy.isfinite(split)]
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
        """Checks that the imported model answers every sample as the library does."""
        samples = self.samples(self.thresholds(path), SAMPLES)
        expected = numpy.asarray(model.predict(samples / 2048)).ravel().astype(str)
        answers, said = self.answers(path, samples=samples, truth=expected)
        self.report(f"{name}: {said}", answers == expected)

    def test_boosted_trees(self):
        light = {"n_estimators": 10, "n_jobs": 1, "verbose": -1}
        cat = {"iterations": 10, "thread_count": 1, "allow_writing_files": False, "verbose": False}
        for classes in (2, 3, 10):
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
