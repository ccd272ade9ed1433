//! A trained model as its trainer saves it, and as it is imported.

use std::path::PathBuf;

use crate::command::run;
use crate::folder::Folder;

/// XGBoost JSON of two classes: the second if feature 0 of frame 69 is −1.5 or above.
pub const XGBOOST: &str = r#"{"learner": {"attributes": {}, "gradient_booster": {"name": "gbtree", "model": {
    "gbtree_model_param": {"num_parallel_tree": "1", "num_trees": "1"}, "tree_info": [0], "trees": [{
    "left_children": [1, -1, -1], "right_children": [2, -1, -1], "split_indices": [69, 0, 0],
    "split_conditions": [-1.5, -1, 1], "split_type": [0, 0, 0], "tree_param": {"size_leaf_vector": "1"}}]}},
    "learner_model_param": {"base_score": "[5E-1]", "num_class": "0", "num_feature": "700"},
    "objective": {"name": "binary:logistic"}}, "version": [3, 2, 0]}"#;

/// Returns a model of two classes that needs this many first frames: the second if feature 0 of one of them is −1.5 or
/// above.
///
/// # Panics
/// If it cannot be imported.
pub fn model(folder: &Folder, name: &str, frames: u32, frame: u32, labels: &str) -> PathBuf {
    let json = XGBOOST.replacen("\"split_indices\": [69", &format!("\"split_indices\": [{frame}"), 1).replacen(
        "\"num_feature\": \"700\"",
        &format!("\"num_feature\": \"{}\"", 10 * frames),
        1,
    );
    let (file, out) = (folder.file(&format!("{name}.json"), json), folder.0.join(format!("{name}.wsm")));
    let (file, path) = (file.to_str().unwrap(), out.to_str().unwrap());
    let done = run(["model", "import", file, "-o", path, "--labels", labels]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    out
}
