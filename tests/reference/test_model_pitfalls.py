"""Tests known pitfalls in the import of trained models. Each of them occurred, or is in the description of a format.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model_pitfalls
"""

import json
import unittest

import numpy
from imported import HIGH, LABELS, LOW, MISSING, SCALE, Imported

if MISSING is None:
    import onnx
    import xgboost
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler, Normalizer, StandardScaler
    from sklearn.svm import SVC, LinearSVC
    from sklearn.tree import DecisionTreeClassifier


class XGBoost(Imported):
    """Tests files of XGBoost."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ten = xgboost.XGBClassifier(n_estimators=5, max_depth=3).fit(cls.X, cls.y)
        cls.two = xgboost.XGBClassifier(n_estimators=5, max_depth=3).fit(cls.X, cls.y > 4)

    def saved(self, model):
        path = self.path / "saved.json"
        model.save_model(path)
        return json.loads(path.read_text())

    def written(self, saved, name="changed.json"):
        path = self.path / name
        path.write_text(json.dumps(saved))
        return path

    def one_split(self, threshold, leaves=(-1.0, 1.0)):
        """Returns a model of two classes with one split of feature 0 of frame 0."""
        saved = self.saved(self.two)
        model = saved["learner"]["gradient_booster"]["model"]
        tree = model["trees"][0]
        for name, values in tree.items():
            if isinstance(values, list):
                real = name in ("base_weights", "loss_changes")
                tree[name] = [] if name.startswith("categories") else [0.0 if real else 0] * 3
        tree.update(left_children=[1, -1, -1], right_children=[2, -1, -1], parents=[2147483647, 0, 0])
        tree.update(split_conditions=[threshold, *leaves], sum_hessian=[3.0, 1.0, 2.0])
        tree["tree_param"]["num_nodes"] = "3"
        model.update(trees=[tree], tree_info=[0], iteration_indptr=[0, 1])
        model["gbtree_model_param"]["num_trees"] = "1"
        saved["learner"]["learner_model_param"]["base_score"] = "[5E-1]"
        saved["learner"]["attributes"] = {}
        return saved

    def agrees(self, name, saved, samples):
        """Returns XGBoost's own answers for a changed file, and those of the import."""
        path = self.written(saved)
        booster = xgboost.Booster(model_file=path)
        votes = booster.predict(xgboost.DMatrix(samples * SCALE))
        expected = (votes > 0.5).astype(int) if votes.ndim == 1 else votes.argmax(axis=1)
        answers, said = self.answers(path, samples=samples)
        self.report(name, answers == expected.astype(str))
        return said

    def test_strictly_below_in_float32(self):
        """Left is strictly below the threshold, in float32. For integers, left is up to the threshold in units, rounded
        up, less 1.
        """
        for threshold in [-1.0, -1.0 + SCALE / 2, numpy.float32(-0.7), 1e-45, -1e-45, 15.99, -16.0, 40.0]:
            samples = numpy.zeros((600, 700), numpy.int16)
            units = int(numpy.clip(threshold / SCALE, -32768 + 3, 32767 - 3))
            samples[:, 0] = numpy.clip(units + numpy.arange(-300, 300), -32768, 32767)
            samples[:6, 0] = [-32768, -32767, -1, 0, 1, 32767]
            self.agrees(f"below {threshold}", self.one_split(float(threshold)), samples)

    def test_margins_are_summed_from_the_base_score_in_order(self):
        """Sums of float32 in another order, or with the base score last, give other answers here."""
        small = float(numpy.float32(2.0**-25))
        for leaves in [[1.0, small, small, -1.0], [small, small, 1.0, -1.0], [small, 1.0, -1.0, 0.0]]:
            saved = self.one_split(-1.0)
            model = saved["learner"]["gradient_booster"]["model"]
            tree = model["trees"][0]
            model["trees"] = [
                {**tree, "id": number, "split_conditions": [-1.0, leaf, -leaf]} for number, leaf in enumerate(leaves)
            ]
            model.update(tree_info=[0] * len(leaves), iteration_indptr=list(range(len(leaves) + 1)))
            model["gbtree_model_param"]["num_trees"] = str(len(leaves))
            samples = numpy.zeros((2, 700), numpy.int16)
            samples[:, 0] = [-3000, 0]
            self.agrees(f"in order {leaves}", saved, samples)

    def test_the_least_probability_above_one_half(self):
        """A score just above 0 is still a probability of 0.5 in float32."""
        for leaf in numpy.arange(0.25, 8, 0.25) * 2.0**-24:
            samples = numpy.zeros((2, 700), numpy.int16)
            samples[:, 0] = [-3000, 0]
            path = self.written(self.one_split(-1.0, (float(-leaf), float(leaf))))
            votes = xgboost.Booster(model_file=path).predict(xgboost.DMatrix(samples * SCALE))
            answers, _ = self.answers(path, samples=samples)
            self.assertEqual(list(answers), list((votes > 0.5).astype(int).astype(str)), leaf)

    def test_softmax_changes_no_answer(self):
        """Tests the same trees as multi:softmax, which gives the class, and as multi:softprob."""
        saved = self.saved(self.ten)
        samples = self.near(3000)
        self.agrees("softprob", saved, samples)
        saved["learner"]["objective"]["name"] = "multi:softmax"
        path = self.written(saved)
        expected = xgboost.Booster(model_file=path).predict(xgboost.DMatrix(samples * SCALE)).astype(int)
        self.report("softmax", self.answers(path, samples=samples)[0] == expected.astype(str))

    def test_base_score_is_a_list_or_one_number(self):
        """The base score is a list with a number for each class since 3.1, and was one number before."""
        saved = self.saved(self.ten)
        parameters = saved["learner"]["learner_model_param"]
        self.assertTrue(parameters["base_score"].startswith("["), parameters)
        samples = self.near(2000)
        self.agrees("a list", saved, samples)
        parameters["base_score"] = "[" + ",".join(str(score / 4) for score in range(10)) + "]"
        self.agrees("a list of its own", saved, samples)
        old = self.saved(self.two)
        for score in ["5E-1", "[2.5E-1]", "1.5E-1"]:
            old["learner"]["learner_model_param"]["base_score"] = score
            self.agrees(f"base_score {score}", old, samples)
        for score in ["NaN", "[5E-1,inf,0]", "0", "1E-42", "x"]:
            old["learner"]["learner_model_param"]["base_score"] = score
            self.refused(self.written(old), "base_score")

    def test_trees_of_one_leaf(self):
        """Trees that are one leaf are legal and common."""
        model = xgboost.XGBClassifier(n_estimators=6, gamma=40).fit(self.X, self.y)
        saved = self.saved(model)
        trees = saved["learner"]["gradient_booster"]["model"]["trees"]
        self.assertTrue(any(len(tree["left_children"]) == 1 for tree in trees))
        self.agrees("trees of one leaf", saved, self.near(3000))
        model = xgboost.XGBClassifier(n_estimators=2, gamma=1e9).fit(self.X, self.y)
        self.agrees("only trees of one leaf", self.saved(model), self.near(10))

    def test_tree_info_is_the_class_of_a_tree(self):
        """The trees of a round need not be in the order of classes."""
        saved = self.saved(self.ten)
        model = saved["learner"]["gradient_booster"]["model"]
        samples = self.near(2000)
        before = self.answers(self.written(saved), samples=samples)[0]
        for number in range(0, len(model["trees"]), 10):
            model["trees"][number : number + 10] = model["trees"][number : number + 10][::-1]
            model["tree_info"][number : number + 10] = model["tree_info"][number : number + 10][::-1]
        after = self.answers(self.written(saved), samples=samples)[0]
        self.report("another order of trees", before == after)
        model["tree_info"] = [(number + 1) % 10 for number in model["tree_info"]]
        parameters = saved["learner"]["learner_model_param"]
        starts = json.loads(parameters["base_score"])
        parameters["base_score"] = json.dumps(starts[-1:] + starts[:-1])
        moved = self.answers(self.written(saved), samples=samples)[0]
        # Of equal scores the first class wins, which is another one then.
        self.assertGreater((moved.astype(int) == (before.astype(int) + 1) % 10).mean(), 0.9)

    def test_the_value_of_a_leaf_is_in_split_conditions(self):
        """`base_weights`, which also has numbers for leaves, is not read."""
        saved = self.saved(self.ten)
        samples = self.near(1000)
        before = self.answers(self.written(saved), samples=samples)[0]
        for tree in saved["learner"]["gradient_booster"]["model"]["trees"]:
            tree["base_weights"] = [9.0 for _ in tree["base_weights"]]
        self.report("base_weights", before == self.answers(self.written(saved), samples=samples)[0])

    def test_a_missing_value_is_none(self):
        """`default_left` is for missing values, and features are never missing."""
        saved = self.saved(self.ten)
        samples = self.near(1000)
        before = self.answers(self.written(saved), samples=samples)[0]
        for tree in saved["learner"]["gradient_booster"]["model"]["trees"]:
            tree["default_left"] = [1 - left for left in tree["default_left"]]
        self.report("default_left", before == self.answers(self.written(saved), samples=samples)[0])

    def test_a_training_with_missing_values_is_said(self):
        """XGBoost's file does not have `missing`, but its splits tell of missing values."""
        X, y = self.X[::4], self.y[::4]
        X = numpy.where(self.random.random(X.shape) < 0.1, 0, X)
        warning = "warning: its training had missing values"
        for method in ("hist", "exact", "approx"):
            for missing, expected in ((numpy.nan, False), (0.0, True)):
                options = {"n_estimators": 2, "max_depth": 3, "n_jobs": 1, "tree_method": method, "missing": missing}
                model = xgboost.XGBClassifier(**options).fit(X, y)
                for ending in ("json", "ubj"):
                    path = self.path / f"missing.{ending}"
                    model.save_model(path)
                    self.assertEqual(warning in self.imported(path)[1], expected, (method, missing, ending))


class Forests(Imported):
    """Tests scikit-learn's forests through ONNX."""

    def test_at_most_in_float64(self):
        """Left is a float32 of at most a float64 threshold. For integers, left is up to the threshold in units, rounded
        down. In ONNX the threshold is float32, one step lower if it was rounded up.
        """
        for step in [0.0, 0.5, 1e-9, -1e-9]:
            X = numpy.zeros((40, 700))
            at = self.random.integers(LOW, HIGH, 40) + step
            X[:, 3] = at * SCALE
            model = DecisionTreeClassifier().fit(X, numpy.arange(40) % 10)
            tree = model.tree_
            samples = self.samples(list(zip(tree.feature[tree.feature >= 0], tree.threshold[tree.feature >= 0])), 500)
            expected = model.predict(samples * SCALE).astype(str)
            self.report(f"thresholds off by {step}", self.answers(self.onnx(model), samples=samples)[0] == expected)

    def test_scaled_thresholds_are_those_of_float32(self):
        """ONNX scales in float32. A threshold decides for every integer as it does there."""
        model = make_pipeline(StandardScaler(), RandomForestClassifier(30, max_depth=9, random_state=1))
        model.fit(self.X, LABELS[self.y])
        path = self.onnx(model)
        scaler = next(node for node in onnx.load(path).graph.node if node.op_type == "Scaler")
        offset, scale = (numpy.array(a.floats, numpy.float32) for a in sorted(scaler.attribute, key=lambda a: a.name))
        # Thresholds of scaled inputs, converted back to units.
        splits = [(f, t / scale[f] + offset[f]) for f, t in self.splits(model[-1])]
        samples = self.samples(splits, 4000)
        scaled = ((samples * SCALE).astype(numpy.float32) - offset) * scale
        self.assertEqual(scaled.dtype, numpy.float32)
        answers, said = self.answers(path, samples=samples)
        self.compare_votes("scaled forest", answers, model[-1], scaled, said)

    def test_what_skl2onnx_writes(self):
        """Tests names and numbers as labels, two classes and more, with and without ZipMap, older operators, and
        doubles.
        """
        for y, zipmap in [(LABELS[self.y], True), (self.y + 5, False), (LABELS[self.y // 5], "columns"), (self.y // 5, True)]:
            # Of few trees votes are often equal.
            model = RandomForestClassifier(31, max_depth=6, random_state=1)
            name = f"{y.dtype}, {len(set(y))} classes, zipmap {zipmap}"
            self.forest(name, model, y, count=200, options={"zipmap": zipmap})
        model = RandomForestClassifier(31, max_depth=6, random_state=1)
        self.forest("oldest operators", model, self.y, count=200, target_opset={"": 11, "ai.onnx.ml": 1})
        self.forest("version 3", model, self.y, count=200, target_opset={"": 15, "ai.onnx.ml": 3})
        for zipmap, y in [(True, LABELS[self.y // 5]), (False, self.y // 5)]:
            for model in [LogisticRegression(), LinearSVC(), SVC(kernel="linear")]:
                options = {} if isinstance(model, LinearSVC) else {"options": {"zipmap": zipmap}}
                self.linear(f"{type(model).__name__}, {y.dtype}", model, y, count=300, weights=["int16"], **options)

    def test_what_is_not_understood_is_refused_by_name(self):
        for model, says in [
            (make_pipeline(Normalizer(), LogisticRegression()), "node Normalizer before"),
            (make_pipeline(MinMaxScaler(clip=True), LogisticRegression()), "node Clip before"),
            (SVC(kernel="rbf"), "kernel_type RBF"),
        ]:
            self.refused(self.onnx(model.fit(self.X, self.y)), says)


if __name__ == "__main__":
    unittest.main()
