//! `wstac model` lists, imports, learns, calibrates, inspects and evaluates texture models.

mod calibrate;
mod eval;
mod import;
mod inspect;
mod learn;
mod list;

use clap::Subcommand;

use super::output::Stop;

/// List, import, learn, calibrate, inspect or evaluate models
///
/// A model file (.wsm) names the texture of a sample. A host loads it, and a board compiles it in. Train with
/// scikit-learn or XGBoost on a data set of wstac dataset, save the model as described below, and import that.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    List(list::Arguments),
    Import(import::Arguments),
    Inspect(inspect::Arguments),
    Eval(eval::Arguments),
    Calibrate(calibrate::Arguments),
    Learn(learn::Arguments),
}

const HELP: &str = r#"From data to a model file, in one command:
  wstac train -o my.wsm                    (see wstac train --help)
  wstac model inspect my.wsm
  wstac run /dev/video0 --model my.wsm
  wstac model learn builtin:embedding slides/ -o my.wsm
                                           (five slides of each texture)

With scikit-learn, for any speed, direction and length:
  wstac dataset --input path sweep.toml -o train.npz
  wstac dataset --input path test.toml -o test.npz
                                           (with first_sensor = 1000)
  pip install scikit-learn skl2onnx xgboost
  In Python:
    import numpy, skl2onnx
    from sklearn.ensemble import RandomForestClassifier
    from skl2onnx.common.data_types import FloatTensorType
    set = numpy.load("train.npz")
    own = set["X_path"].any(axis=(1, 2))   # zeros: no velocity
    X = set["X_path"][own, :, :39]         # 28 mm of path
    X = X.reshape(len(X), -1) * set["scale"]
    y = set["y_specimen"][own]
    model = RandomForestClassifier(100, max_depth=12).fit(X, y)
    types = [("X", FloatTensorType([None, 390]))]
    onnx = skl2onnx.convert_sklearn(model, initial_types=types)
    open("forest.onnx", "wb").write(onnx.SerializeToString())
  wstac model import forest.onnx -o forest.wsm --input path
  wstac model eval forest.wsm test.npz
  With --input taxel-path, take X_taxel_path[own, :, :28]; with
  --input taxels all of X_taxels, 1750 inputs.

Over time, for the speeds and directions of the training only:
  Leave out --input, and take X of shape (n, 10, 70): 700 inputs.
  The same as Rust code for a board:
  wstac model import forest.onnx -o forest.rs
  A linear SVM (SVC(kernel="linear") or LinearSVC) needs no
  StandardScaler: it would scale the noise of dark frames up to the size
  of the signal.

With XGBoost, and X and y as above:
    import xgboost
    names = sorted(numpy.unique(y))
    model = xgboost.XGBClassifier()
    model.fit(X, numpy.searchsorted(names, y))
    model.save_model("boosted.json"); print(",".join(names))
  wstac model import boosted.json -o boosted.wsm --labels NAMES

From recordings:
  wstac run clip.y4m --json --samples prints samples as real numbers.
  Save numpy.rint(2048 * sample).astype("int16") of all events as X, and
  their labels as y, with numpy.savez.

Models that can be imported:
  scikit-learn, as ONNX of skl2onnx:
    RandomForestClassifier, ExtraTreesClassifier, DecisionTreeClassifier,
    BaggingClassifier of trees
      Thresholds are exact. Votes are exact if leaves are of one class,
      otherwise within the bound that import prints.
    GradientBoostingClassifier, HistGradientBoostingClassifier
      Thresholds are exact. Import prints how close two scores must be
      for the library, which adds float64, to answer otherwise.
    LogisticRegression, LinearSVC, SVC(kernel="linear"), SGDClassifier,
    Perceptron, OneVsRestClassifier of these, and other linear ones
      Weights are int16, or int32 where rounding may change answers;
      import prints by how much a score may be off, and a warning if X was
      not times its scale.
    MLPClassifier of one or two hidden layers of up to 128, relu
      Weights as of linear ones; give import --check.
    Before any of them StandardScaler, MinMaxScaler, SimpleImputer,
    SelectKBest and other selections; before linear ones PCA, too
      Thresholds of trees behind a scaler are those of ONNX, which scales
      in float32.
      A LinearSVC behind a StandardScaler converts with
      options={LinearSVC: {"raw_scores": True}}. In Python,
      wstac.save(model, X, "my.wsm") converts and compares answers.
  XGBoost, as save_model("FILE.json") or save_model("FILE.ubj"):
    XGBClassifier, XGBRFClassifier (gbtree)
      Trees, leaves and the order of their sums are exact. The file has
      no labels: use import --labels.
  LightGBM, as ONNX of onnxmltools.convert_lightgbm, and CatBoost, as
  save_model("FILE.onnx", format="onnx"):
      As GradientBoostingClassifier. Not LightGBM's boosting_type="rf".
  ONNX of other programs:
    The operators TreeEnsembleClassifier, TreeEnsemble, LinearClassifier,
    SVMClassifier (linear kernel), and MatMul or Gemm, as of linear layers
    of PyTorch or Keras, also with Relu between. The error names any other
    operator on the way to the label.

Inputs and limits:
  A model has 700 inputs, feature by feature: X.reshape(n, 700) of a data
  set, times its scale; one of taxels has 1750. A model that answers
  after the first N frames has X[:, :, :N].reshape(n, 10 * N); it cannot
  answer before frame 15, when the trigger fires. Of the path, the first
  N tens are its start; a slide that shows less of it has no answer. A
  model has at most 64 classes and 65535 trees.
  Exit code: 0, 1 if a file cannot be used, 2 for wrong arguments.
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    match &arguments.command {
        Command::List(arguments) => list::run(arguments),
        Command::Import(arguments) => import::run(arguments),
        Command::Inspect(arguments) => inspect::run(arguments),
        Command::Eval(arguments) => eval::run(arguments),
        Command::Calibrate(arguments) => calibrate::run(arguments),
        Command::Learn(arguments) => learn::run(arguments),
    }
}
