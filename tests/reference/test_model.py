"""Tests `wstac model`: imported models answer as the trained ones do. Skipped without scikit-learn, xgboost and
skl2onnx.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model
"""

import unittest

from imported import LABELS, MISSING, Imported

if MISSING is None:
    import xgboost
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC
    from sklearn.tree import DecisionTreeClassifier


class Agreement(Imported):
    """Tests early answers, warnings and refusals."""

    def test_early_answers(self):
        names = LABELS[self.y]
        for inputs in [10, 200, 690]:
            self.forest(
                f"forest of {inputs // 10} frames", RandomForestClassifier(20, random_state=1), names, inputs=inputs
            )
            self.assertIn(
                f"frames    {inputs // 10} of a sample", self.wstac("inspect", self.path / "model.wsm").stdout
            )
        model = xgboost.XGBClassifier(n_estimators=8, max_depth=3)
        self.boosted("XGBoost of 20 frames", model, self.y, LABELS, inputs=200)
        self.refused(self.onnx(DecisionTreeClassifier().fit(self.X[:, :15], names), 15), "15 inputs", "700")

    def test_linear_models_that_are_not_as_trained_have_a_warning(self):
        # The better classes are apart, the smaller are weights beside biases.
        self.data(10, noise=500)
        names = LABELS[self.y]
        self.refused(
            self.onnx(SVC(kernel="linear").fit(self.integers, names)),
            "names every sample",
            "help: train it on X * scale (scale is 1/2048)",
        )
        # Half of the inputs hardly vary, as those of dark frames.
        X = self.X.copy()
        X[:, ::2] = -4.6 + self.random.normal(0, 1e-4, X[:, ::2].shape)
        for model, options, concerned in [
            (LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), ["--weights", "int16"], "10 classes"),
            (make_pipeline(StandardScaler(), SVC(kernel="linear")), ["--weights", "int8"], "45 pairs of classes"),
        ]:
            _, said = self.imported(self.onnx(model.fit(X, names)), *options)
            self.assertRegex(said, rf"warning: rounded weights may change the scores of \d+ of {concerned}")

    def test_what_is_not_understood_is_refused_by_name(self):
        two = (self.y > 4).astype(int)
        self.refused(self.onnx(SVC(kernel="rbf").fit(self.X, two)), "kernel_type RBF")
        for name, model, says in [
            ("dart", xgboost.XGBClassifier(n_estimators=2, booster="dart"), '"dart"'),
            ("linear", xgboost.XGBClassifier(n_estimators=2, booster="gblinear"), '"gblinear"'),
            ("regression", xgboost.XGBRegressor(n_estimators=2), '"reg:squarederror"'),
        ]:
            path = self.path / f"{name}.json"
            model.fit(self.X, two).save_model(path)
            self.refused(path, says)


if __name__ == "__main__":
    unittest.main()
