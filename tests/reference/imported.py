"""Shared code of the agreement tests: trained models through `wstac model`, compared with their own answers."""

import json
import os
import subprocess
import tempfile
import unittest
import warnings
from pathlib import Path

# Waiting threads must not slow down the others.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numpy  # noqa: E402

try:
    import skl2onnx
    import sklearn  # noqa: F401
    import xgboost  # noqa: F401
    from skl2onnx.common.data_types import DoubleTensorType, FloatTensorType

    MISSING = None
except ImportError as error:
    MISSING = str(error)

LABELS = numpy.array(["Fla0", "Saw2", "Saw3", "Saw4", "Sin2", "Sin3", "Sin4", "Tri2", "Tri3", "Tri4"])
SCALE = 1 / 2048
LOW, HIGH = -9471, 3296
# What the tests draw; another seed must not change what passes.
SEED = int(os.environ.get("MODEL_SEED", "7"))
# The number of random samples of the domain, and of samples on thresholds.
SAMPLES = 10_000
# Votes that came through ONNX in float32 may be tied if they differ by less than this.
NEAR = 2.0**-20


@unittest.skipIf(MISSING, f"needs requirements-train.txt: {MISSING}")
@unittest.skipUnless("WSTAC" in os.environ, "needs WSTAC, the path that ci/build wstac prints")
class Imported(unittest.TestCase):
    """Provides training data, and a folder for files."""

    @classmethod
    def setUpClass(cls):
        warnings.filterwarnings("ignore")
        cls.chance(SEED)
        cls.data(10)
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = Path(cls.folder.name)

    def setUp(self):
        """Draws the same data for a test alone as for all of them."""
        self.chance(SEED)
        self.data(10)

    @classmethod
    def chance(cls, seed):
        """Starts everything that is random again; estimators without a `random_state` have numpy's."""
        numpy.random.seed(seed)
        cls.random = numpy.random.default_rng(seed)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def data(cls, classes, noise=2500, inputs=700):
        """Sets `integers`, `X` and `y`: 400 samples around a center for each class."""
        cls.y = cls.random.integers(0, classes, 400)
        cls.y[:classes] = numpy.arange(classes)
        centers = cls.random.normal(0, 900, (classes, inputs))
        spread = cls.random.normal(0, noise, (400, inputs))
        cls.integers = numpy.clip(-4000 + centers[cls.y] + spread, LOW, HIGH).astype(numpy.int16)
        cls.X = cls.integers * SCALE

    def wstac(self, *arguments, code=0):
        command = [os.environ["WSTAC"], "model", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def refused(self, file, *says, options=()):
        """Checks that import refuses a file with a message that names it."""
        output = self.path / "refused.wsm"
        output.unlink(missing_ok=True)
        said = self.wstac("import", file, "-o", output, *options, code=1).stderr
        for part in [str(file), *says]:
            self.assertIn(part, said)
        self.assertFalse(output.exists())

    def imported(self, file, *options):
        """Imports a model twice, and checks that the bytes are equal. Returns the model file and the messages of
        import.
        """
        model = self.path / "model.wsm"
        said = self.wstac("import", file, "-o", model, "--force", *options).stderr
        first = model.read_bytes()
        self.wstac("import", file, "-o", model, "--force", *options)
        self.assertEqual(model.read_bytes(), first)
        inspected = json.loads(self.wstac("inspect", model, "--json").stdout)
        self.assertEqual(inspected["bytes"], len(first))
        return model, said.strip().partition("; ")[2].strip()

    def evaluated(self, model, samples, truth=None):
        """Returns the answers of a model file for samples."""
        data = self.path / "data.npz"
        X = "X_taxels" if samples.shape[1:] == (1750,) else "X"
        numpy.savez(data, **({X: samples} if truth is None else {X: samples, "y": truth}))
        found = json.loads(self.wstac("eval", model, data, "--json").stdout)
        self.assertEqual(found["n"], len(samples))
        answers = numpy.array(found["predictions"])
        if truth is None:
            self.assertIsNone(found["accuracy"])
        else:
            self.assertAlmostEqual(found["accuracy"], (answers == truth.astype(str)).mean())
        return answers

    def answers(self, file, *options, samples, truth=None):
        """Returns the answers of the imported model for samples, and the messages of import."""
        model, said = self.imported(file, *options)
        return self.evaluated(model, samples, truth), said

    def onnx(self, model, inputs=700, real="Float", **options):
        path = self.path / "model.onnx"
        kind = {"Float": FloatTensorType, "Double": DoubleTensorType}[real]
        made = skl2onnx.convert_sklearn(model, initial_types=[("X", kind([None, inputs]))], **options)
        path.write_bytes(made.SerializeToString())
        return path

    def near(self, count):
        """Returns samples of the domain."""
        samples = self.integers[self.random.integers(0, len(self.integers), count)]
        noise = self.random.integers(-3000, 3001, samples.shape, dtype=numpy.int16)
        return numpy.clip(samples + noise, LOW, HIGH).astype(numpy.int16)

    def samples(self, thresholds=(), count=SAMPLES):
        """Returns samples of the domain, and as many with values on thresholds, one unit below and above."""
        samples = self.near(2 * count if len(thresholds) else count)
        by_input = {}
        for feature, threshold in thresholds:
            by_input.setdefault(int(feature), []).append(int(numpy.floor(threshold / SCALE)))
        for feature, values in by_input.items():
            values = self.random.choice(values, count) + self.random.integers(-1, 2, count)
            samples[count:, feature] = numpy.clip(values, -32768, 32767)
        return samples

    def proves(self, name, enough):
        """Checks that at least half of the samples were compared."""
        self.assertTrue(enough, f"{name}: too few samples are outside the bound")

    def report(self, name, same, left_out=0):
        left = f", {left_out} left out" if left_out else ""
        print(f"{name}: {same.sum()} of {len(same)} alike{left}")
        self.assertTrue(same.all())

    @staticmethod
    def first(X, inputs):
        """Returns the first frames of samples."""
        return X.reshape(-1, 10, 70)[:, :, : inputs // 10].reshape(-1, inputs)

    @staticmethod
    def splits(model, inputs=700):
        """Returns the features of whole samples, and the thresholds of all splits of a forest or tree."""
        trees = [tree.tree_ for tree in getattr(model, "estimators_", [model])]
        frames = inputs // 10
        pairs = [(tree.feature[inner], tree.threshold[inner]) for tree in trees for inner in [tree.feature >= 0]]
        return [(f // frames * 70 + f % frames, t) for features, all in pairs for f, t in zip(features, all)]

    def compare_votes(self, name, answers, model, seen, said=""):
        """Compares the answers of a forest with its own. They must be equal if votes differ by more than 2^-20, or are
        tied. If import reports votes that are rounded to a unit, that rounding decides ties.
        """
        votes = model.predict_proba(seen)
        best = numpy.sort(votes, axis=1)
        lead = best[:, -1] - best[:, -2]
        same = answers == model.predict(seen).astype(str)
        hard = (lead <= NEAR) & ((lead > 0) | ("votes are in units" in said))
        print(f"{name}: {same.sum()} of {len(same)} alike in all, {(lead == 0).sum()} ties; {said}")
        self.proves(name, hard.mean() < 0.5)
        self.report(f"{name}, ties included", same[~hard], hard.sum())
        # If rounding decides, the answer is still one of the best.
        number = {label: at for at, label in enumerate(model.classes_.astype(str))}
        numbers = [number[answer] for answer in answers]
        self.assertTrue((best[:, -1] - votes[numpy.arange(len(votes)), numbers] <= NEAR).all())

    def forest(self, name, model, y, inputs=700, count=SAMPLES, **options):
        """Trains a forest, imports it through ONNX and compares."""
        model.fit(self.first(self.X, inputs), y)
        samples = self.samples(self.splits(model, inputs), count)
        seen = self.first(samples * SCALE, inputs)
        answers, said = self.answers(self.onnx(model, inputs, **options), samples=samples, truth=model.predict(seen))
        self.compare_votes(name, answers, model, seen, said)

    def boosted(self, name, model, y, labels=None, endings=("json", "ubj"), inputs=700, count=SAMPLES, **fit):
        """Trains boosted trees, imports them from each kind of file and compares. Returns the messages of import."""
        model.fit(self.first(self.X, inputs), y, **fit)
        path, frames, splits = self.path / "model.json", inputs // 10, []
        model.save_model(path)
        for tree in json.loads(path.read_text())["learner"]["gradient_booster"]["model"]["trees"]:
            nodes = zip(tree["left_children"], tree["split_indices"], tree["split_conditions"])
            splits += [(f // frames * 70 + f % frames, split) for left, f, split in nodes if left >= 0]
        samples = self.samples(splits, count)
        expected = model.predict(self.first(samples * SCALE, inputs))
        expected = expected.astype(str) if labels is None else numpy.array(labels)[expected]
        options = [] if labels is None else ["--labels", ",".join(labels)]
        said = ""
        for ending in endings:
            path = self.path / f"model.{ending}"
            model.save_model(path)
            # The content of the file shows its kind.
            file = path.rename(self.path / "model")
            answers, said = self.answers(file, *options, samples=samples, truth=expected)
            self.report(f"{name}, {ending}", answers == expected)
        answers, short = self.answers(file, *options, "--leaves", "int16", samples=samples)
        same = answers == expected
        print(f"  with int16 leaves: {same.sum()} of {len(same)} alike; {short}")
        bound = float(short.split("off by ")[1].split()[0]) if "off by " in short else 0.0
        margins = model.predict(self.first(samples * SCALE, inputs), output_margin=True).reshape(len(samples), -1)
        best = numpy.sort(margins, axis=1)
        lead = numpy.abs(margins[:, 0]) if margins.shape[1] == 1 else best[:, -1] - best[:, -2]
        # Float32 itself adds to the bound.
        far = lead > 2 * bound + 1e-5
        self.proves(name, far.mean() > 0.5)
        self.report(f"{name}, int16, outside the bound {bound:.1e}", same[far], (~far).sum())
        return said

    def linear(self, name, model, y, count=SAMPLES, weights=("int16", "int8"), write=None, **options):
        """Trains a linear model, imports it through ONNX and compares its answers outside the bound that import prints.
        Import chooses the weights that are `None`. If given, `write` writes the ONNX file instead of skl2onnx.
        """
        model.fit(self.X, y)
        # Between samples of different classes, so that some are close to where the answer changes.
        share = self.random.random((count, 1))
        samples = (share * self.near(count) + (1 - share) * self.near(count)).astype(numpy.int16)
        expected = model.predict(samples * SCALE).astype(str)
        last = model[-1] if hasattr(model, "steps") else model
        pairs = hasattr(last, "support_vectors_")
        if pairs:
            last.decision_function_shape = "ovo"
        scores = model.decision_function(samples * SCALE).reshape(count, -1)
        for kind in weights:
            width = ["--weights", kind] if kind else []
            answers, said = self.answers((write or self.onnx)(model, **options), *width, samples=samples)
            # Weights of int16 are as good as the trained ones here, or import makes them int32.
            self.assertTrue(kind == "int8" or "warning" not in said, said)
            bound = float(said.split("off by ")[1].split()[0])
            # ONNX's float32 adds to the bound: weights have 24 bits.
            bound += 1e-5 * numpy.abs(scores).max()
            if scores.shape[1] == 1:
                near = numpy.abs(scores[:, 0]) <= bound
            elif pairs:
                near = ~decided(scores, bound, len(last.classes_))
            else:
                best = numpy.sort(scores, axis=1)
                near = best[:, -1] - best[:, -2] <= 2 * bound
            same = answers == expected
            print(f"{name}, {kind}: {same.sum()} of {len(same)} alike in all")
            self.proves(name, near.mean() < 0.5)
            self.report(f"{name}, {kind}, outside the bound {bound:.1e}", same[~near], near.sum())


def decided(scores, bound, classes):
    """Returns whether votes of pairs of classes have the same winner if scores move within a bound: (n,)."""
    least, most = numpy.zeros((2, len(scores), classes), int)
    pairs = [(first, second) for first in range(classes) for second in range(first + 1, classes)]
    for score, (first, second) in zip(scores.T, pairs, strict=True):
        least[:, first] += score > bound
        least[:, second] += score < -bound
        most[:, first] += score >= -bound
        most[:, second] += score <= bound
    # If several have as many votes, the lowest wins.
    rank = classes * most - numpy.arange(classes)
    winner = (classes * least - numpy.arange(classes)).argmax(axis=1)
    rows = numpy.arange(len(scores))
    sure = classes * least[rows, winner] - winner
    rank[rows, winner] = -classes
    return sure > rank.max(axis=1)
