"""Tests `wstac model` with TreeEnsemble, of version 5 of ONNX's machine learning operators, which scikit-learn's
converter does not write yet. Forests are written in it here, and compared with scikit-learn and ONNX's own reference.

    WSTAC=$(../../ci/build wstac) $(../../ci/tool python train) -m unittest -v test_model_version5
"""

import unittest

import numpy
from imported import LABELS, MISSING, NEAR, SCALE, Imported

if MISSING is None:
    import onnx
    from onnx import TensorProto, helper, numpy_helper
    from onnx.reference import ReferenceEvaluator
    from sklearn.ensemble import RandomForestClassifier


class Version5(Imported):
    """Tests `TreeEnsemble`, which replaces `TreeEnsembleClassifier` in version 5 of ONNX's operators."""

    def ensemble(self, model, soft, double=False, labels=None, mirrored=False):
        """Returns a forest as TreeEnsemble and ArgMax. A leaf has one class, so soft votes need a tree for each class."""
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
                    # "Above" is the opposite of "at most".
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
            ("pure leaves, double", {}, False, {"double": True, "mirrored": True}),
            ("soft votes", {"max_depth": 5}, True, {"labels": list(LABELS)}),
        ]:
            model = RandomForestClassifier(20, random_state=1, **options).fit(self.X, self.y)
            path, made = self.ensemble(model, soft, **more)
            samples = self.samples(self.splits(model), 600)
            answers, said = self.answers(path, samples=samples)
            numbers = numpy.searchsorted(LABELS, answers).astype(str) if "labels" in more else answers
            self.compare_votes(f"TreeEnsemble, {name}", numbers, model, samples * SCALE, said)
            # ONNX's own reference gives the same answers.
            few = samples[590:]
            kind = numpy.float64 if "double" in more else numpy.float32
            votes = numpy.sort(model.predict_proba(few * SCALE), axis=1)
            clear = votes[:, -1] - votes[:, -2] > NEAR
            expected = ReferenceEvaluator(made).run(None, {"X": (few * SCALE).astype(kind)})[0]
            self.assertTrue((expected.astype(str) == answers[590:])[clear].all())


if __name__ == "__main__":
    unittest.main()
