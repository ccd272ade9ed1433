//! `wstac model`: trained texture models become model files, which are looked into and judged.

mod eval;
mod import;
mod inspect;

use clap::Subcommand;

use super::output::Stop;

/// Make a model file of a trained texture model, look into one, judge one on a data set
///
/// A model file (.wsm) names the texture of a sample: a board compiles it in, a host loads it. Train with scikit-learn or
/// XGBoost on what wstac dataset wrote, save as described below, and import that.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Import(import::Arguments),
    Inspect(inspect::Arguments),
    Eval(eval::Arguments),
}

const HELP: &str = r#"From data to a model file:
  wstac dataset sweep.toml -o train.npz
  In Python:
    set = numpy.load("train.npz")
    X, y = set["X"].reshape(len(set["X"]), -1) * set["scale"], set["y_specimen"]
    # a linear SVM (SVC(kernel="linear") or LinearSVC) needs no StandardScaler: it makes the noise
    # of dark frames as large as what lit frames show
    model = RandomForestClassifier(100, max_depth=12).fit(X, y)
    onnx = skl2onnx.convert_sklearn(model, initial_types=[("X", FloatTensorType([None, 700]))])
    open("forest.onnx", "wb").write(onnx.SerializeToString())
  wstac model import forest.onnx -o forest.wsm
  wstac model inspect forest.wsm
  wstac model eval forest.wsm test.npz
  wstac run /dev/video0 --model forest.wsm
  wstac model import forest.onnx -o forest.rs     the same as Rust code, for a board

With XGBoost:
    names = sorted(set(y))
    model = XGBClassifier().fit(X, numpy.searchsorted(names, y))
    model.save_model("boosted.json"); print(",".join(names))
  wstac model import boosted.json -o boosted.wsm --labels NAMES

From recordings: wstac run clip.y4m --json --samples prints samples as real numbers; save
numpy.rint(2048 * sample).astype("int16") of all events as X, and what they are as y, with numpy.savez.

Models that are understood:
  scikit-learn, as ONNX of skl2onnx
    RandomForestClassifier, ExtraTreesClassifier, DecisionTreeClassifier
                           thresholds are exact; votes are exact where leaves are of one class,
                           otherwise within the bound that import prints; behind a StandardScaler
                           thresholds are those of ONNX, which scales in float32
    LogisticRegression, LinearSVC and other linear classifiers, SVC(kernel="linear"),
    with or without a StandardScaler before them
                           weights are rounded; import prints by how much a score may be off
                           a LinearSVC behind a StandardScaler converts with
                           convert_sklearn(…, options={LinearSVC: {"raw_scores": True}})
  ONNX of others, in the operators TreeEnsembleClassifier (a forest), TreeEnsemble and ArgMax,
    LinearClassifier, SVMClassifier (linear kernel); labels may pass LabelEncoder,
    ArrayFeatureExtractor or Gather. Other operators on the way to the label are refused by name
  XGBoost, as save_model("FILE.json") or save_model("FILE.ubj")
    XGBClassifier, XGBRFClassifier (gbtree)
                           exact: trees, leaves and the order of their sums. It saves no labels:
                           import --labels
Inputs are 700, feature by feature (X.reshape(n, 700) of a data set, times its scale), or
X[:, :, :N].reshape(n, 10 * N) for a model that answers after the first N frames (or after 15,
when the trigger fires). At most 64 classes, 65535 trees.

Exit code: 0; 1 where a file cannot be used, 2 for wrong arguments.
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    match &arguments.command {
        Command::Import(arguments) => import::run(arguments),
        Command::Inspect(arguments) => inspect::run(arguments),
        Command::Eval(arguments) => eval::run(arguments),
    }
}
