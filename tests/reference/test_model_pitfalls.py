"""Where imports of trained models go wrong: each of these was met, or stands in a format's description.

    WSTAC=$(../../ci/wstac) $(../../ci/python train) -m unittest -v test_model_pitfalls
"""

import json
import unittest

import numpy
from imported import HIGH, LABELS, LOW, MISSING, NEAR, SCALE, Imported

if MISSING is None:
    import onnx
    import xgboost
    from onnx import TensorProto, helper, numpy_helper
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler, Normalizer, StandardScaler
    from sklearn.svm import SVC, LinearSVC
    from sklearn.tree import DecisionTreeClassifier


class XGBoost(Imported):
    """What XGBoost saves."""

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
        """A model of two classes with one split of feature 0 of frame 0."""
        saved = self.saved(self.two)
        model = saved["learner"]["gradient_booster"]["model"]
        tree = model["trees"][0]
        for name, values in tree.items():
            if isinstance(values, list):
                tree[name] = [] if name.startswith("categories") else [0, 0, 0]
        tree.update(left_children=[1, -1, -1], right_children=[2, -1, -1], parents=[2147483647, 0, 0])
        tree.update(split_conditions=[threshold, *leaves], sum_hessian=[3.0, 1.0, 2.0])
        tree["tree_param"]["num_nodes"] = "3"
        model.update(trees=[tree], tree_info=[0], iteration_indptr=[0, 1])
        model["gbtree_model_param"]["num_trees"] = "1"
        saved["learner"]["learner_model_param"]["base_score"] = "[5E-1]"
        saved["learner"]["attributes"] = {}
        return saved

    def agrees(self, name, saved, samples):
        """A changed file: XGBoost's own answers and those of the import."""
        path = self.written(saved)
        booster = xgboost.Booster(model_file=path)
        votes = booster.predict(xgboost.DMatrix(samples * SCALE))
        expected = (votes > 0.5).astype(int) if votes.ndim == 1 else votes.argmax(axis=1)
        answers, said = self.answers(path, samples=samples)
        self.report(name, answers == expected.astype(str))
        return said

    def test_strictly_below_in_float32(self):
        """Left is strictly below, in float32: on integers up to the threshold in units, rounded up, less 1."""
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
        """A score just above 0 still is a probability of 0.5 in float32."""
        for leaf in numpy.arange(0.25, 8, 0.25) * 2.0**-24:
            samples = numpy.zeros((2, 700), numpy.int16)
            samples[:, 0] = [-3000, 0]
            path = self.written(self.one_split(-1.0, (float(-leaf), float(leaf))))
            votes = xgboost.Booster(model_file=path).predict(xgboost.DMatrix(samples * SCALE))
            answers, _ = self.answers(path, samples=samples)
            self.assertEqual(list(answers), list((votes > 0.5).astype(int).astype(str)), leaf)

    def test_softmax_changes_no_answer(self):
        """The same trees as multi:softmax, which says the class, and multi:softprob."""
        saved = self.saved(self.ten)
        samples = self.near(3000)
        self.agrees("softprob", saved, samples)
        saved["learner"]["objective"]["name"] = "multi:softmax"
        path = self.written(saved)
        expected = xgboost.Booster(model_file=path).predict(xgboost.DMatrix(samples * SCALE)).astype(int)
        self.report("softmax", self.answers(path, samples=samples)[0] == expected.astype(str))

    def test_base_score_is_a_list_or_one_number(self):
        """A list for each class since 3.1, one number before."""
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
        """Trees of a round need not be in the order of classes."""
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
        """And `base_weights`, which also has numbers for leaves, is not looked at."""
        saved = self.saved(self.ten)
        samples = self.near(1000)
        before = self.answers(self.written(saved), samples=samples)[0]
        for tree in saved["learner"]["gradient_booster"]["model"]["trees"]:
            tree["base_weights"] = [9.0 for _ in tree["base_weights"]]
        self.report("base_weights", before == self.answers(self.written(saved), samples=samples)[0])

    def test_ubjson_is_the_default_format(self):
        """A name without an ending that is known is written as UBJSON."""
        path = self.path / "default.model"
        self.ten.get_booster().save_model(path)
        self.assertNotEqual(path.read_bytes()[1:2], b'"')
        samples = self.near(2000)
        expected = self.ten.predict(samples * SCALE).astype(str)
        self.report("default format", self.answers(path, samples=samples)[0] == expected)

    def test_leaves_are_int16_where_that_is_proven(self):
        """Multiples of 2^-10 are; one leaf of 24 bits is not, and int16 by force then says by how much it is off."""
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
        """NaN and infinity in every float; numbers too small for float32's usual form are exact."""
        for number, shown in [(float("nan"), "NaN"), (float("inf"), "Infinity"), (float("-inf"), "-Infinity")]:
            for saved in [self.one_split(number), self.one_split(-1.0, (number, 1.0))]:
                path = self.written(saved)
                self.assertIn(shown, path.read_text())
                self.refused(path, "split_conditions")
                # The same as UBJSON, which can say such numbers.
                text = path.read_bytes()
                large = self.written(json.loads(text.replace(shown.encode(), b"1e30")))
                booster = xgboost.Booster(model_file=large)
                raw = bytes(booster.save_raw("ubj"))
                one = numpy.float32(1e30).astype(">f4").tobytes()
                self.assertEqual(raw.count(one), 1)
                path = self.path / "changed.ubj"
                path.write_bytes(raw.replace(one, numpy.float32(number).astype(">f4").tobytes()))
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
    """scikit-learn's forests through ONNX."""

    def test_at_most_in_float64(self):
        """Left is float32 at most a float64 threshold: on integers up to the threshold in units, rounded down. In ONNX the
        threshold is float32, stepped down where rounding went up."""
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
        """Two votes each: the lowest class wins, of two and of ten classes."""
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
        """Ten weights a leaf, zeros included; lists of numbers unpacked, as other writers leave them."""
        model = RandomForestClassifier(5, max_depth=8, random_state=1).fit(self.X, self.y)
        path = self.onnx(model)
        samples = self.near(2000)
        before = self.answers(path, samples=samples)[0]
        found = onnx.load(path)
        node = next(node for node in found.graph.node if node.op_type == "TreeEnsembleClassifier")
        lists = {attribute.name: attribute for attribute in node.attribute}
        self.assertEqual(len(lists["class_weights"].floats), 10 * list(lists["nodes_modes"].strings).count(b"LEAF"))
        self.assertIn(0.0, lists["class_weights"].floats)
        # Field 7 is floats, 8 integers: each number becomes a field.
        packed = path.read_bytes()
        path.write_bytes(unpacked(found))
        self.assertGreater(path.stat().st_size, len(packed))
        onnx.checker.check_model(onnx.load(path))
        self.report("unpacked", before == self.answers(path, samples=samples)[0])

    def test_scaled_thresholds_are_those_of_float32(self):
        """ONNX scales in float32: a threshold decides for every integer as it does there."""
        model = make_pipeline(StandardScaler(), RandomForestClassifier(30, max_depth=9, random_state=1))
        model.fit(self.X, LABELS[self.y])
        path = self.onnx(model)
        scaler = next(node for node in onnx.load(path).graph.node if node.op_type == "Scaler")
        offset, scale = (numpy.array(a.floats, numpy.float32) for a in sorted(scaler.attribute, key=lambda a: a.name))
        # Thresholds of scaled inputs, back in units.
        splits = [(f, t / scale[f] + offset[f]) for f, t in self.splits(model[-1])]
        samples = self.samples(splits, 4000)
        scaled = ((samples * SCALE).astype(numpy.float32) - offset) * scale
        self.assertEqual(scaled.dtype, numpy.float32)
        answers, said = self.answers(path, samples=samples)
        self.compare_votes("scaled forest", answers, model[-1], scaled, said)

    def test_what_skl2onnx_writes(self):
        """Names and numbers as labels, two classes and more, with and without ZipMap, older operators, doubles."""
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
        """Sums that 32 bits could not hold: every product is of the largest sizes."""
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


class Version5(Imported):
    """`TreeEnsemble`, which version 5 of ONNX's operators has in place of `TreeEnsembleClassifier`."""

    def ensemble(self, model, soft, double=False, labels=None, mirrored=False):
        """A forest as TreeEnsemble and ArgMax: a leaf has one class, so soft votes take a tree for each class."""
        lists = {name: [] for name in ["featureids", "truenodeids", "falsenodeids", "trueleafs", "falseleafs"]}
        splits, modes, weights, targets, roots = [], [], [], [], []
        trees = [tree.tree_ for tree in getattr(model, "estimators_", [model])]
        classes = len(model.classes_)
        for tree in trees:
            for target in range(classes) if soft else [None]:
                start = len(splits)
                roots.append(start)
                inner = numpy.flatnonzero(tree.feature >= 0) if tree.node_count > 1 else numpy.array([0])
                place = {int(node): start + at for at, node in enumerate(inner)}

                def leaf(node):
                    value = tree.value[node][0] / tree.value[node][0].sum()
                    of = int(value.argmax()) if target is None else target
                    weights.append(value[of] / len(trees))
                    targets.append(of)
                    return len(weights) - 1

                for node in inner:
                    children = [tree.children_left[node], tree.children_right[node]]
                    if tree.node_count == 1:
                        ends = [(leaf(0), 1)] * 2
                    else:
                        ends = [(leaf(c), 1) if tree.feature[c] < 0 else (place[int(c)], 0) for c in children]
                    # Above is the other way round of at most.
                    mode = 3 if mirrored else 0
                    for side, (number, is_leaf) in zip(["false", "true"] if mirrored else ["true", "false"], ends):
                        lists[f"{side}nodeids"].append(number)
                        lists[f"{side}leafs"].append(is_leaf)
                    lists["featureids"].append(max(int(tree.feature[node]), 0))
                    threshold = tree.threshold[node] if tree.node_count > 1 else 0.0
                    single = numpy.float32(threshold)
                    if not double and single > threshold:
                        single = numpy.nextafter(single, numpy.float32(-numpy.inf))
                    splits.append(threshold if double else single)
                    modes.append(mode)
        kind = numpy.float64 if double else numpy.float32
        attributes = {f"nodes_{name}": values for name, values in lists.items()}
        attributes["nodes_splits"] = numpy_helper.from_array(numpy.array(splits, kind))
        attributes["leaf_weights"] = numpy_helper.from_array(numpy.array(weights, kind))
        attributes["nodes_modes"] = numpy_helper.from_array(numpy.array(modes, numpy.uint8))
        nodes = [
            helper.make_node(
                "TreeEnsemble", ["X"], ["scores"], domain="ai.onnx.ml", n_targets=classes, tree_roots=roots,
                leaf_targetids=targets, aggregate_function=1, post_transform=0, **attributes,
            ),
            helper.make_node("ArgMax", ["scores"], ["class" if labels else "label"], axis=1, keepdims=0),
        ]  # fmt: skip
        if labels:
            keys = {"keys_int64s": list(range(classes)), "values_strings": list(labels)}
            nodes.append(helper.make_node("LabelEncoder", ["class"], ["label"], domain="ai.onnx.ml", **keys))
        of = TensorProto.DOUBLE if double else TensorProto.FLOAT
        graph = helper.make_graph(
            nodes, "forest",
            [helper.make_tensor_value_info("X", of, [None, 700])],
            [helper.make_tensor_value_info("label", TensorProto.STRING if labels else TensorProto.INT64, [None])],
        )  # fmt: skip
        made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 21), helper.make_opsetid("ai.onnx.ml", 5)])
        onnx.checker.check_model(made)
        path = self.path / "five.onnx"
        path.write_bytes(made.SerializeToString())
        return path, made

    def test_tree_ensemble(self):
        for name, options, soft, more in [
            ("pure leaves", {}, False, {}),
            ("pure leaves, double", {}, False, {"double": True, "mirrored": True}),
            ("soft votes", {"max_depth": 5}, True, {"labels": LABELS}),
            ("soft votes, double", {"max_depth": 5}, True, {"double": True}),
            ("trees of one leaf", {"max_leaf_nodes": 2, "min_samples_leaf": 150}, True, {"mirrored": True}),
        ]:
            model = RandomForestClassifier(20, random_state=1, **options).fit(self.X, self.y)
            path, made = self.ensemble(model, soft, **more)
            samples = self.samples(self.splits(model), 3000)
            answers, said = self.answers(path, samples=samples)
            numbers = numpy.searchsorted(LABELS, answers).astype(str) if "labels" in more else answers
            self.compare_votes(f"TreeEnsemble, {name}", numbers, model, samples * SCALE, said)
            # ONNX's own reference says the same.
            few = samples[2990:3010]
            kind = numpy.float64 if "double" in more else numpy.float32
            votes = numpy.sort(model.predict_proba(few * SCALE), axis=1)
            clear = votes[:, -1] - votes[:, -2] > NEAR
            expected = onnx.reference.ReferenceEvaluator(made).run(None, {"X": (few * SCALE).astype(kind)})[0]
            self.assertTrue((expected.astype(str) == answers[2990:3010])[clear].all())


def unpacked(message):
    """A message's bytes with each number of a list in a field of its own."""

    def varint(number):
        number &= (1 << 64) - 1
        data = bytearray()
        while number >= 0x80:
            data.append(number & 0x7F | 0x80)
            number >>= 7
        return bytes(data + bytes([number]))

    data = b""
    for field, value in message.ListFields():
        values = value if field.is_repeated else [value]
        for one in values:
            if field.message_type is not None:
                inner = unpacked(one)
                data += varint(field.number << 3 | 2) + varint(len(inner)) + inner
            elif field.type == field.TYPE_FLOAT:
                data += varint(field.number << 3 | 5) + numpy.float32(one).tobytes()
            elif field.type in (field.TYPE_STRING, field.TYPE_BYTES):
                inner = one.encode() if isinstance(one, str) else one
                data += varint(field.number << 3 | 2) + varint(len(inner)) + inner
            else:
                data += varint(field.number << 3) + varint(int(one))
    return data


if __name__ == "__main__":
    unittest.main()
