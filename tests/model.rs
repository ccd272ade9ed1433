//! `wstac model`: from a trainer's file to answers, and what it refuses.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use wstac_tests::command::wstac;

/// A new folder, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("wstac-model-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn model(arguments: &[&str]) -> Output {
    Command::new(wstac()).arg("model").args(arguments).output().unwrap()
}

fn good(arguments: &[&str]) -> String {
    let done = model(arguments);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

fn bad(arguments: &[&str], parts: &[&str]) {
    let done = model(arguments);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(1), "{said}");
    for part in parts {
        assert!(said.contains(part), "{part}: {said}");
    }
}

/// Two classes; the second where feature 0 of frame 69 is −1.5 or above.
const XGBOOST: &str = r#"{"learner": {"attributes": {}, "gradient_booster": {"name": "gbtree", "model": {
    "gbtree_model_param": {"num_parallel_tree": "1", "num_trees": "1"}, "tree_info": [0], "trees": [{
    "left_children": [1, -1, -1], "right_children": [2, -1, -1], "split_indices": [69, 0, 0],
    "split_conditions": [-1.5, -1, 1], "split_type": [0, 0, 0], "tree_param": {"size_leaf_vector": "1"}}]}},
    "learner_model_param": {"base_score": "[5E-1]", "num_class": "0", "num_feature": "700"},
    "objective": {"name": "binary:logistic"}}, "version": [3, 2, 0]}"#;

/// A zip archive of stored members, without checksums, which are not looked at.
fn npz(arrays: &[(&str, &str, Vec<u8>)]) -> Vec<u8> {
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (name, header, data) in arrays {
        let name = format!("{name}.npy");
        let mut npy = b"\x93NUMPY\x01\x00".to_vec();
        npy.extend((header.len() as u16).to_le_bytes());
        npy.extend(header.as_bytes());
        npy.extend(data);
        let mut common = vec![20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        common.extend([(npy.len() as u32).to_le_bytes(); 2].concat());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        directory.extend(b"PK\x01\x02\x14\x03");
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend((archive.len() as u32).to_le_bytes());
        directory.extend(name.as_bytes());
        archive.extend(b"PK\x03\x04");
        archive.extend(common);
        archive.extend(name.as_bytes());
        archive.extend(npy);
    }
    let start = archive.len() as u32;
    archive.extend(&directory);
    archive.extend(b"PK\x05\x06\0\0\0\0\0\0\0\0");
    archive.extend((directory.len() as u32).to_le_bytes());
    archive.extend(start.to_le_bytes());
    archive.extend([0, 0]);
    archive
}

fn header(descr: &str, shape: &str) -> String {
    format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n")
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn from_a_trainers_file_to_answers() {
    let folder = Folder::new("whole");
    let (file, out) = (folder.file("trained", XGBOOST.as_bytes()), folder.0.join("out.wsm"));
    let (file, out) = (text(&file), text(&out));
    good(&["import", file, "-o", out, "--labels", "Fla,Saw"]);
    bad(&["import", file, "-o", out], &["out.wsm", "exists already", "--force"]);
    let first = fs::read(out).unwrap();
    good(&["import", file, "-o", out, "--labels", "Fla,Saw", "--force"]);
    assert_eq!(fs::read(out).unwrap(), first);
    let found: serde_json::Value = serde_json::from_str(&good(&["inspect", out, "--json"])).unwrap();
    assert_eq!((&found["task"], &found["trees"]["splits"]), (&"pattern".into(), &1.into()));
    assert_eq!(found["training"], r#"{"file":"trained","trainer":"XGBoost 3.2.0"}"#);
    assert!(good(&["inspect", out]).contains("Fla, Saw"));
    let mut samples = vec![[0_i16; 700]; 4];
    for (sample, x) in samples.iter_mut().zip([-3073, -3072, -32_768, 5]) {
        sample[69] = x;
    }
    let samples: Vec<u8> = samples.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let truth: Vec<u8> = "FlaSawSawSaw".chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
    let x = ("X", header("<i2", "(4, 10, 70)"), samples);
    let data = npz(&[("X", &x.1, x.2.clone()), ("y_pattern", &header("<U3", "(4,)"), truth)]);
    let data = folder.file("data.npz", &data);
    let found: serde_json::Value = serde_json::from_str(&good(&["eval", out, text(&data), "--json"])).unwrap();
    assert_eq!(found, serde_json::json!({"n": 4, "accuracy": 0.75, "predictions": ["Fla", "Saw", "Fla", "Saw"]}));
    assert!(good(&["eval", out, text(&data)]).contains("75.00 % right: 3 of 4 samples, by y_pattern"));
    let data = folder.file("no-truth.npz", &npz(&[("X", &x.1, x.2.clone())]));
    let found: serde_json::Value = serde_json::from_str(&good(&["eval", out, text(&data), "--json"])).unwrap();
    assert!(found["accuracy"].is_null());
    for (name, bytes, parts) in [
        ("zip", b"no archive".to_vec(), &["no zip archive"][..]),
        ("empty", npz(&[]), &["array X", "is missing"]),
        ("type", npz(&[("X", &header("<f4", "(4, 700)"), vec![])]), &["array X", "<f4", "<i2"]),
        ("shape", npz(&[("X", &header("<i2", "(4, 70, 10)"), vec![])]), &["array X", "[4, 70, 10]", "(n, 10, 70)"]),
        ("many", npz(&[("X", &header("<i2", "(99999999999, 700)"), vec![])]), &["array X", "99999999999"]),
        ("short", npz(&[("X", &header("<i2", "(5, 10, 70)"), x.2.clone())]), &["array X", "less data"]),
        ("header", npz(&[("X", "{}", vec![])]), &["array X", "descr"]),
        ("y", npz(&[("X", &x.1, x.2.clone()), ("y", &header("<i8", "(3,)"), vec![0; 24])]), &["array y", "[3]"]),
        ("kind", npz(&[("X", &x.1, x.2.clone()), ("y", &header("|O", "(4,)"), vec![])]), &["array y", "|O"]),
    ] {
        let data = folder.file(name, &bytes);
        bad(&["eval", out, text(&data)], parts);
    }
    for length in [0, 1, 2, 31, first.len() - 2] {
        let cut = folder.file("cut.wsm", &first[..length]);
        bad(&["inspect", text(&cut)], &["cut.wsm"]);
        bad(&["eval", text(&cut), text(&data)], &["cut.wsm"]);
    }
}

#[test]
fn what_is_no_model_is_refused_by_field() {
    let folder = Folder::new("refused");
    let out = folder.0.join("out.wsm");
    for (from, to, parts) in [
        ("[1, -1, -1]", "[0, -1, -1]", &["tree 0 of score 0", "node 0 is reached twice"][..]),
        ("[1, -1, -1]", "[2, -1, -1]", &["node 2 is reached twice"]),
        ("[1, -1, -1]", "[9, -1, -1]", &["node 9 is a child, expected one of 3"]),
        ("[1, -1, -1]", "[-1, -1, -1]", &["trees[0].left_children[0] is -1"]),
        ("[1, -1, -1]", "[1, -1]", &["trees[0].right_children has 3 numbers, expected 2"]),
        ("[69, 0, 0]", "[700, 0, 0]", &["node 0: input 700"]),
        ("[-1.5, -1, 1]", "[1e60, -1, 1]", &["node 0: threshold inf"]),
        ("[-1.5, -1, 1]", "[-1.5, 1e30, 1]", &["leaf 1", "below 2^96"]),
        ("[0, 0, 0]", "[0, 1, 0]", &["split_type[1] is categorical"]),
        ("binary:logistic", "rank:ndcg", &["objective.name is \"rank:ndcg\"", "multi:softprob"]),
        ("\"num_feature\": \"700\"", "\"num_feature\": \"701\"", &["701 inputs"]),
        ("[5E-1]", "[5E-1,1]", &["base_score is \"[5E-1,1]\""]),
        ("[5E-1]", "[1]", &["base_score is 1", "probability"]),
        ("\"tree_info\": [0]", "\"tree_info\": [1]", &["tree_info[0] is 1"]),
        ("gbtree\"", "dart\"", &["\"dart\", expected \"gbtree\""]),
        ("\"learner\"", "\"teacher\"", &["JSON: missing field `learner`"]),
    ] {
        let file = folder.file("trained.json", XGBOOST.replacen(from, to, 1).as_bytes());
        bad(&["import", text(&file), "-o", text(&out)], &[&["trained.json"], parts].concat());
    }
    for (bytes, parts) in [
        (&b""[..], &["is empty"][..]),
        (b"{", &["JSON"]),
        (b"{L\0", &["UBJSON", "the file ends"]),
        (b"WSM1", &["is a model file already"]),
        (b"something else", &["as ONNX it"]),
        (&b"[".repeat(1 << 20), &["as ONNX it"]),
        (&b"{\"a\":".repeat(1 << 20), &["JSON: EOF"]),
    ] {
        let file = folder.file("trained", bytes);
        bad(&["import", text(&file), "-o", text(&out)], parts);
    }
    let file = folder.file("trained", XGBOOST.as_bytes());
    bad(&["import", text(&file), "-o", text(&out), "--labels", "a,b,c"], &["has 2 classes, and --labels names 3"]);
    assert!(!out.exists());
}
