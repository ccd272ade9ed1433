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
        moved = self.answers(self.written(saved), samples=samples)[0]
        self.assertTrue((moved.astype(int) == (before.astype(int) + 1) % 10).mean() > 0.9)

    def test_the_value_of_a_leaf_is_in_split_conditions(self):
        """`base_weights`, which also has numbers for leaves, is not read."""
        saved = self.saved(self.ten)
        samples = self.near(1000)
        before = self.answers(self.written(saved), samples=samples)[0]
        for tree in saved["learner"]["gradient_booster"]["model"]["trees"]:
            tree["base_weights"] = [9.0 for _ in tree["base_weights"]]
        self.report("base_weights", before == self.answers(self.written(saved), samples=samples)[0])

    def test_ubjson_is_the_default_format(self):
        """A file whose name has no known ending is written as UBJSON."""
        path = self.path / "default.model"
        self.ten.get_booster().save_model(path)
        self.assertNotEqual(path.read_bytes()[1:2], b'"')
        samples = self.near(2000)
        expected = self.ten.predict(samples * SCALE).astype(str)
        self.report("default format", self.answers(path, samples=samples)[0] == expected)

    def test_leaves_are_int16_where_that_is_proven(self):
        """Multiples of 2^-10 are exact. One leaf of 24 bits is not, and with forced int16 import reports the error."""
        saved = self.saved(self.ten)
        parameters = saved["learner"]["learner_model_param"]
        parameters["base_score"] = "[" + ",".join(["5E-1"] * 10) + "]"
        trees = saved["learner"]["gradient_booster"]["model"]["trees"]
        for tree in trees:
            pairs = zip(tree["left_children"], tree["split_conditions"])
            tree["split_conditions"] = [c if left >= 0 else round(c * 1024) / 1024 for left, c in pairs]
        samples = self.near(4000)
        said = self.agrees("leaves of 2^-10", saved, samples)
        self.assertIn("leaves are int16, and their sums proven", said)
        small = json.loads(self.wstac("inspect", self.path / "model.wsm", "--json").stdout)["bytes"]
        floats, _ = self.answers(self.written(saved), "--leaves", "float32", samples=samples)
        large = json.loads(self.wstac("inspect", self.path / "model.wsm", "--json").stdout)["bytes"]
        self.assertLess(small, large)
        self.report("as float32", floats == self.answers(self.written(saved), "--leaves", "auto", samples=samples)[0])
        trees[0]["split_conditions"][-1] = float(numpy.float32(0.1))
        said = self.agrees("one leaf of 24 bits", saved, samples)
        self.assertIn("leaves and the order of their sums are exact", said)
        _, said = self.answers(self.written(saved), "--leaves", "int16", samples=samples)
        self.assertIn("a score is off by", said)

    def test_a_missing_value_is_none(self):
        """`default_left` is for missing values, and features are never missing."""
        saved = self.saved(self.ten)
        samples = self.near(1000)
        before = self.answers(self.written(saved), samples=samples)[0]
        for tree in saved["learner"]["gradient_booster"]["model"]["trees"]:
            tree["default_left"] = [1 - left for left in tree["default_left"]]
        self.report("default_left", before == self.answers(self.written(saved), samples=samples)[0])

    def test_numbers_that_are_none_are_named(self):
        """Tests NaN and infinity in every float. Numbers too small for float32's usual form are exact."""
        for number, shown in [(float("nan"), "NaN"), (float("inf"), "Infinity"), (float("-inf"), "-Infinity")]:
            for saved in [self.one_split(number), self.one_split(-1.0, (number, 1.0))]:
                path = self.written(saved)
                self.assertIn(shown, path.read_text())
                self.refused(path, "split_conditions")
                # The same as UBJSON, which can express such numbers.
                text = path.read_bytes()
                large = self.written(json.loads(text.replace(shown.encode(), b"1e30")))
                booster = xgboost.Booster(model_file=large)
                raw = bytes(booster.save_raw("ubj"))
                one = numpy.array(1e30, ">f4").tobytes()
                self.assertEqual(raw.count(one), 1)
                path = self.path / "changed.ubj"
                path.write_bytes(raw.replace(one, numpy.array(number, ">f4").tobytes()))
                self.refused(path, "trees[0].split_conditions[")
        samples = numpy.zeros((3, 700), numpy.int16)
        samples[:, 0] = [-3000, 0, 3000]
        tiny = float(numpy.float32(1e-45))
        self.agrees("subnormal leaves", self.one_split(-1.0, (-tiny, tiny)), samples)

    def test_categorical_splits_are_refused(self):
        saved = self.one_split(-1.0)
        saved["learner"]["gradient_booster"]["model"]["trees"][0]["split_type"] = [1, 0, 0]
        self.refused(self.written(saved), "trees[0].split_type[0] is categorical")


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

    def test_ties_are_the_lowest_class(self):
        """If two classes have two votes each, the lowest class wins, of two and of ten classes."""
        for y in [LABELS[self.y], self.y > 4]:
            model = RandomForestClassifier(4, random_state=1).fit(self.X, numpy.asarray(y).astype(str))
            samples = self.near(4000)
            votes = numpy.sort(model.predict_proba(samples * SCALE), axis=1)
            ties = (votes[:, -1] == votes[:, -2]).sum()
            self.assertGreater(ties, 100)
            expected = model.predict(samples * SCALE)
            self.report(f"{ties} ties", self.answers(self.onnx(model), samples=samples)[0] == expected)

    def test_pruned_forests_have_soft_votes(self):
        """Hard votes of the same trees would differ."""
        names = LABELS[self.y]
        model = RandomForestClassifier(40, max_depth=3, random_state=1)
        self.forest("soft votes", model, names, count=3000)
        samples = self.near(3000) * SCALE
        hard = numpy.array([tree.predict(samples) for tree in model.estimators_]).astype(int)
        hard = model.classes_[[numpy.bincount(votes).argmax() for votes in hard.T]]
        self.assertGreater((hard != model.predict(samples)).sum(), 20)

    def test_lists_are_packed_or_not_and_have_zeros(self):
        """Tests leaves of ten weights, zeros included. Lists have a field for each number, or are packed into one, as
        other writers do.
        """
        model = RandomForestClassifier(5, max_depth=8, random_state=1).fit(self.X, self.y)
        path = self.onnx(model)
        samples = self.near(2000)
        before = self.answers(path, samples=samples)[0]
        found = onnx.load(path)
        node = next(node for node in found.graph.node if node.op_type == "TreeEnsembleClassifier")
        lists = {attribute.name: attribute for attribute in node.attribute}
        self.assertEqual(len(lists["class_weights"].floats), 10 * list(lists["nodes_modes"].strings).count(b"LEAF"))
        self.assertIn(0.0, lists["class_weights"].floats)
        plain = path.read_bytes()
        path.write_bytes(packed(found))
        self.assertLess(path.stat().st_size, len(plain))
        self.assertEqual(onnx.load(path), found)
        self.report("packed", before == self.answers(path, samples=samples)[0])

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
        for y in [LABELS[self.y], self.y, self.y + 5, LABELS[self.y // 5], self.y // 5, self.y > 4]:
            for zipmap in [True, False, "columns"]:
                model = RandomForestClassifier(7, max_depth=6, random_state=1)
                name = f"{y.dtype}, {len(set(y))} classes, zipmap {zipmap}"
                y = y.astype(int) if y.dtype == bool else y
                self.forest(name, model, y, count=200, options={"zipmap": zipmap})
        model = RandomForestClassifier(7, max_depth=6, random_state=1)
        self.forest("oldest operators", model, self.y, count=200, target_opset={"": 11, "ai.onnx.ml": 1})
        self.forest("version 3", model, self.y, count=200, target_opset={"": 15, "ai.onnx.ml": 3})
        for zipmap in [True, False]:
            for y in [LABELS[self.y // 5], self.y // 5]:
                for model in [LogisticRegression(), LinearSVC(), SVC(kernel="linear")]:
                    options = {} if isinstance(model, LinearSVC) else {"options": {"zipmap": zipmap}}
                    self.linear(f"{type(model).__name__}, {y.dtype}", model, y, count=300, weights=["int16"], **options)

    def test_what_stands_before_is_refused_by_name(self):
        for before, says in [(Normalizer(), "node Normalizer before"), (MinMaxScaler(), "node Add before")]:
            model = make_pipeline(before, LogisticRegression()).fit(self.X, self.y)
            self.refused(self.onnx(model), says)

    def test_linear_svc_is_one_node_class_by_class(self):
        model = LinearSVC(random_state=1).fit(self.X, LABELS[self.y])
        nodes = [node for node in onnx.load(self.onnx(model)).graph.node if node.op_type == "LinearClassifier"]
        lists = {attribute.name: attribute.floats for attribute in nodes[0].attribute}
        self.assertEqual(len(nodes), 1)
        numpy.testing.assert_allclose(numpy.reshape(lists["coefficients"], (10, 700)), model.coef_, rtol=1e-6)
        self.linear("class by class", model, LABELS[self.y], count=2000)

    def test_weights_and_samples_at_their_limits(self):
        """Tests sums that 32 bits could not hold: every product has the largest size."""
        model = LogisticRegression(max_iter=1).fit(self.X, self.y)
        model.coef_ = self.random.choice([-1.0, 1.0], model.coef_.shape)
        model.intercept_ = numpy.zeros(10)
        samples = self.random.choice([-32768, 32767], (2000, 700)).astype(numpy.int16)
        samples[:10] = numpy.where(model.coef_ > 0, 32767, -32768)
        samples[10:20] = -1 - samples[:10]
        scores = samples * SCALE @ model.coef_.T
        best = numpy.sort(scores, axis=1)
        for kind in ["int16", "int8"]:
            answers, said = self.answers(self.onnx(model), "--weights", kind, samples=samples)
            clear = best[:, -1] - best[:, -2] > 1e-3
            self.assertGreater(clear.sum(), 1500)
            self.report(f"limits, {kind}; {said}", (answers == scores.argmax(axis=1).astype(str))[clear], (~clear).sum())


def packed(message):
    """Returns a message's bytes with each list of numbers in one field."""

    def varint(number):
        number &= (1 << 64) - 1
        data = bytearray()
        while number >= 0x80:
            data.append(number & 0x7F | 0x80)
            number >>= 7
        return bytes(data + bytes([number]))

    def block(number, inner):
        return varint(number << 3 | 2) + varint(len(inner)) + inner

    data = b""
    for field, value in message.ListFields():
        values = value if field.is_repeated else [value]
        if field.message_type is not None:
            data += b"".join(block(field.number, packed(one)) for one in values)
        elif field.type in (field.TYPE_STRING, field.TYPE_BYTES):
            data += b"".join(block(field.number, one.encode() if isinstance(one, str) else one) for one in values)
        elif field.type == field.TYPE_FLOAT:
            bits = b"".join(numpy.float32(one).tobytes() for one in values)
            data += block(field.number, bits) if field.is_repeated else varint(field.number << 3 | 5) + bits
        else:
            bits = b"".join(varint(int(one)) for one in values)
            data += block(field.number, bits) if field.is_repeated else varint(field.number << 3) + bits
    return data


if __name__ == "__main__":
    unittest.main()
