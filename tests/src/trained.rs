//! A trained model as its trainer saves it.

/// XGBoost's JSON of two classes; the second where feature 0 of frame 69 is −1.5 or above.
pub const XGBOOST: &str = r#"{"learner": {"attributes": {}, "gradient_booster": {"name": "gbtree", "model": {
    "gbtree_model_param": {"num_parallel_tree": "1", "num_trees": "1"}, "tree_info": [0], "trees": [{
    "left_children": [1, -1, -1], "right_children": [2, -1, -1], "split_indices": [69, 0, 0],
    "split_conditions": [-1.5, -1, 1], "split_type": [0, 0, 0], "tree_param": {"size_leaf_vector": "1"}}]}},
    "learner_model_param": {"base_score": "[5E-1]", "num_class": "0", "num_feature": "700"},
    "objective": {"name": "binary:logistic"}}, "version": [3, 2, 0]}"#;
