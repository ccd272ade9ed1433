//! Tests `wstac model`: from a trainer's file to answers, and what it refuses.

use std::fs;
use std::process::Output;

use serde_json::{Value, json};
use wstac_tests::command::{assert_has, printed, refused, run, said, says};
use wstac_tests::folder::{Folder, text};
use wstac_tests::npz::{header, npz, zip64};
use wstac_tests::trained::XGBOOST;

fn model(arguments: &[&str]) -> Output {
    run(&[&["model"], arguments].concat())
}

fn good(arguments: &[&str]) -> String {
    printed(&model(arguments))
}

/// Returns the object that a command prints.
fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&good(&[arguments, &["--json"]].concat())).unwrap()
}

/// Returns the array `X` of these numbers.
fn array_x(shape: &str, numbers: &[[i16; 700]]) -> (&'static str, String, Vec<u8>) {
    ("X", header("<i2", shape), numbers.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect())
}

/// Returns an array of labels, whose letters follow each other in `labels`.
fn array_of(name: &'static str, letters: usize, labels: &str) -> (&'static str, String, Vec<u8>) {
    let shape = format!("({},)", labels.len() / letters);
    (name, header(&format!("<U{letters}"), &shape), labels.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect())
}

fn bad(arguments: &[&str], parts: &[&str]) {
    refused(&[&["model"], arguments].concat(), parts);
}

#[test]
fn from_a_trainers_file_to_answers() {
    let folder = Folder::new("whole");
    let (file, out) = (&*folder.written("trained", XGBOOST), &*folder.path("out.wsm"));
    good(&["import", file, "-o", out, "--labels", "Fla,Saw"]);
    let first = fs::read(out).unwrap();
    good(&["import", file, "-o", out, "--labels", "Fla,Saw", "--force"]);
    assert_eq!(fs::read(out).unwrap(), first);
    let found = json(&["inspect", out]);
    assert_eq!((&found["task"], &found["trees"]["splits"]), (&"pattern".into(), &1.into()));
    assert_eq!(found["training"], r#"{"file":"trained","trainer":"XGBoost 3.2.0"}"#);
    assert!(good(&["inspect", out]).contains("Fla, Saw"));
    let mut samples = vec![[0_i16; 700]; 4];
    for (sample, x) in samples.iter_mut().zip([-3073, -3072, -32_768, 5]) {
        sample[69] = x;
    }
    let x = array_x("(4, 10, 70)", &samples);
    let arrays = [x.clone(), array_of("y_pattern", 3, "FlaSawSawSaw")];
    let data = folder.file("data.npz", npz(&arrays));
    let all = json(&["eval", out, text(&data)]);
    let counts = json!({"n": 4, "right": 3, "accuracy": 0.75, "answered": 4, "accuracy_of_answered": 0.75});
    let mut expected = counts.as_object().unwrap().clone();
    expected.insert("predictions".to_owned(), json!(["Fla", "Saw", "Fla", "Saw"]));
    assert_eq!(all, Value::Object(expected));
    assert!(good(&["eval", out, text(&data)]).contains("75.00 % right: 3 of 4 samples, by y_pattern"));
    let large = zip64(&arrays);
    assert_eq!(json(&["eval", out, text(&folder.file("large.npz", &large))]), all);
    for at in (0..large.len()).step_by(3) {
        // Damage is an error, or changes numbers and names only. It never panics.
        if !(150..large.len() - 350).contains(&at) {
            let mut damaged = large.clone();
            damaged[at] ^= 0x41;
            let done = model(&["eval", out, text(&folder.file("damaged.npz", &damaged))]);
            assert!(matches!(done.status.code(), Some(0 | 1)), "{at}: {}", said(&done));
        }
    }
    let data = folder.file("no-truth.npz", npz(std::slice::from_ref(&x)));
    assert!(json(&["eval", out, text(&data)])["accuracy"].is_null());
    for (name, bytes, parts) in [
        ("zip", b"no archive".to_vec(), &["no zip archive"][..]),
        ("empty", npz::<&str>(&[]), &["array X", "is missing"]),
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
    // Errors have the name of the file, what was found, and what was expected.
    let words = first.len() / 4;
    let mut longer = first.clone();
    longer.extend([0; 8]);
    let changed = |at: usize, byte: u8| {
        let mut changed = first.clone();
        changed[at] = byte;
        changed
    };
    for (bytes, says) in [
        (changed(3, b'3'), "another version, expected WSM1 or WSM2: import the model again (byte 3 is 51)".to_owned()),
        (changed(2, b'X'), "does not start with WSM1".to_owned()),
        (longer, format!("({} words, expected {words})", words + 2)),
        (changed(first.len() - 6, 0xFF), "its checksum is wrong: it is damaged (".to_owned()),
    ] {
        bad(&["inspect", text(&folder.file("changed.wsm", &bytes))], &["changed.wsm: ", &says]);
    }
}

#[test]
fn truth_of_other_labels_is_said() {
    let folder = Folder::new("others");
    let (file, out) = (&*folder.written("trained", XGBOOST), &*folder.path("out.wsm"));
    good(&["import", file, "-o", out, "--labels", "Fla,Saw"]);
    let said = |truth: [i64; 2], labels: &str| {
        let numbers = ("y", header("<i8", "(2,)"), truth.map(i64::to_le_bytes).concat());
        let truth = if labels.is_empty() { numbers } else { array_of("y", 3, labels) };
        let data = folder.file("data.npz", npz(&[array_x("(2, 700)", &[[0; 700]; 2]), truth]));
        says(&model(&["eval", out, text(&data), "--json"]), 0, &[])
    };
    assert_has(&said([0, 1], ""), &["out.wsm names Fla, Saw; y of ", "data.npz also has 0, 1: 2 of 2 samples"]);
    assert!(said([0, 0], "TriSin").contains(" also has Tri, Sin: 2 of 2 samples cannot be right"));
    // Labels that are shared in part.
    assert!(said([0, 0], "TriSaw").contains(" also has Tri: 1 of 2 samples cannot be right"));
    assert_eq!(said([0, 0], "FlaSaw"), "");
}

#[test]
fn options_of_other_models_are_refused() {
    let folder = Folder::new("options");
    let boosted = folder.file("boosted.json", XGBOOST.as_bytes());
    let forest = folder.file("forest.onnx", include_bytes!("../fuzz/seeds/model_import/forest.onnx"));
    let set = folder.file("set.npz", npz(&[("X", &header("<i2", "(1, 700)"), vec![1; 1400])]));
    let (out, weights) = (folder.0.join("out"), "--weights is for linear models");
    for (file, option, output, parts) in [
        (&boosted, ["--weights", "int16"], "wsm", [weights, "boosted.json holds boosted trees"]),
        (&boosted, ["--note", "a"], "rs", ["--note is for model files", "leave it out"]),
        (&forest, ["--leaves", "auto"], "wsm", ["--leaves is for boosted trees", "forest.onnx holds a forest"]),
        (&forest, ["--check", text(&set)], "rs", ["--check is for model files", "check one of them"]),
        (&forest, ["--weights", "int8"], "rs", [weights, "forest.onnx holds a forest"]),
    ] {
        let out = out.with_extension(output);
        says(&model(&["import", text(file), "-o", text(&out), option[0], option[1]]), 2, &parts);
        assert!(!out.exists());
        good(&["import", text(file), "-o", text(&out)]);
        fs::remove_file(out).unwrap();
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
        ("[-1.5, -1, 1]", "[1e60, -1, 1]", &["trees[0].split_conditions[0] is inf"]),
        ("[-1.5, -1, 1]", "[-1.5, 1e30, 1]", &["leaf 1", "below 2^96"]),
        ("[0, 0, 0]", "[0, 1, 0]", &["split_type[1] is categorical"]),
        ("binary:logistic", "rank:ndcg", &["objective.name is \"rank:ndcg\"", "multi:softprob"]),
        ("\"num_feature\": \"700\"", "\"num_feature\": \"701\"", &["701 inputs"]),
        ("[5E-1]", "[5E-1,1]", &["base_score is \"[5E-1,1]\""]),
        ("[5E-1]", "[1]", &["base_score is 1", "probability"]),
        ("\"tree_info\": [0]", "\"tree_info\": [1]", &["tree_info[0] is 1"]),
        ("gbtree\"", "dart\"", &["\"dart\", expected \"gbtree\""]),
        // A value that is no number in JSON is known by its key only.
        ("[-1.5, -1, 1]", "[-1.5, NaN, 1]", &["JSON", "in split_conditions"]),
        ("[-1.5, -1, 1]", "[-Infinity, -1, 1]", &["JSON", "in split_conditions"]),
        ("[5E-1]", "[NaN]", &["base_score is \"[NaN]\""]),
        ("[5E-1]", "[1E-42]", &["base_score is 0.000", "almost 0"]),
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
        (
            b"\x80\x05\x95\x1a\0",
            &["is a pickle, which only Python can read", "skl2onnx.to_onnx(model, X[:1].astype(\"float32\"))"],
        ),
        (b"[{ \"nodeid\": 0 }]", &["XGBoost's dump_model writes", "model.save_model(\"my.json\")"]),
        (b"booster[0]:\n0:[f190<-2.5]", &["XGBoost's dump_model writes", "model.save_model(\"my.json\")"]),
        (b"binf\0\0\0?", &["an old binary file of XGBoost", "model.save_model(\"my.json\")"]),
        (
            &[&[0; 144][..], b"multi:softprob\x06\0\0\0\0\0\0\0gbtree", &[0; 99]].concat(),
            &["old binary file of XGBoost"],
        ),
        (b"tree\nversion=v4\n", &["is text of LightGBM", "onnxmltools.convert_lightgbm("]),
        (b"{\"name\": \"tree\", \"num_tree_per_iteration\": 3}", &["is JSON of LightGBM", "convert_lightgbm("]),
        (b"CBM1\x88k", &["a binary file of CatBoost", "format=\"onnx\""]),
        (b"{ \"features_info\": {} }", &["is JSON of CatBoost", "format=\"onnx\""]),
        (&b"[".repeat(1 << 20), &["a list in JSON"]),
        (&b"{\"a\":".repeat(1 << 20), &["JSON: EOF"]),
    ] {
        let file = folder.file("trained", bytes);
        bad(&["import", text(&file), "-o", text(&out)], parts);
    }
    let marked = folder.file("marked", [b"\xEF\xBB\xBF", XGBOOST.as_bytes()].concat());
    good(&["import", text(&marked), "-o", text(&folder.0.join("marked.wsm"))]);
    let file = folder.file("trained", XGBOOST.as_bytes());
    bad(&["import", text(&file), "-o", text(&out), "--labels", "a,b,c"], &["has 2 classes, and --labels names 3"]);
    assert!(!out.exists());
}

#[test]
fn a_model_of_the_first_frames_looks_at_no_others() {
    let folder = Folder::new("early");
    let out = &folder.path("out.wsm");
    // Ten features of each frame; input 3 is feature 1 of frame 1.
    let of = |inputs: &str| {
        let early = XGBOOST.replacen("[69, 0, 0]", "[3, 0, 0]", 1).replacen("\"700\"", &format!("\"{inputs}\""), 1);
        folder.written("trained", early)
    };
    good(&["import", &of("20"), "-o", out]);
    assert_eq!(json(&["inspect", out])["frames"], 2);
    let mut samples = vec![[0_i16; 700]; 2];
    // In a data set all frames of a feature follow each other.
    samples[0][70 + 1] = -3073;
    samples[1].fill(-3073);
    samples[1][70 + 1] = -3072;
    let data = folder.file("data.npz", npz(&[array_x("(2, 10, 70)", &samples)]));
    assert_eq!(json(&["eval", out, text(&data)])["predictions"], json!(["0", "1"]));
    let import = |inputs: &str, more: &[&str], code: i32, parts: &[&str]| {
        says(&model(&[&["import", &of(inputs), "-o", out, "--force"], more].concat()), code, parts)
    };
    import("20", &[], 0, &["20 inputs: taken as the first 2 frames over time; help: "]);
    assert!(!import("20", &["--input", "frames"], 0, &[]).contains("taken as"));
    assert!(!import("700", &[], 0, &[]).contains("taken as"));
    // So many are those of taxels, and of no other input.
    for taxels in [&[][..], &["--input", "taxels"]] {
        import("1750", taxels, 0, &[]);
        assert!(good(&["inspect", out]).contains("taxels"));
    }
    for (inputs, input) in [("1750", "path"), ("1750", "frames"), ("700", "taxels")] {
        let expected =
            format!("{inputs} inputs, expected 1750 with --input taxels, and at most 700 with another input");
        import(inputs, &["--input", input], 1, &[&expected]);
    }
    // These are as many as shipped models along the path take.
    for (inputs, option) in [("390", "path"), ("280", "taxel-path")] {
        let expected = format!("expected --input {option} or --input frames");
        import(inputs, &[], 2, &[&expected, &format!("has {inputs} inputs")]);
        for input in [option, "frames"] {
            import(inputs, &["--input", input], 0, &[]);
        }
    }
    for inputs in ["0", "15", "710"] {
        import(inputs, &[], 1, &[&format!("{inputs} inputs, expected 700"), "X_path or X_taxel_path"]);
    }
}

#[test]
fn leaves_are_int16_where_that_is_proven() {
    let folder = Folder::new("leaves");
    let out = &folder.path("out.wsm");
    let kept = |leaves: &str, option: &[&str]| {
        let trained = XGBOOST.replacen("[-1.5, -1, 1]", &format!("[-1.5, {leaves}]"), 1);
        let file = folder.file("trained", trained.as_bytes());
        let said = says(&model(&[&["import", text(&file), "-o", out, "--force"], option].concat()), 0, &[]);
        (json(&["inspect", out])["numbers"].as_str().unwrap().to_owned(), said)
    };
    // Thresholds in units of samples instead of features.
    let (_, said) = kept("-1, 1", &[]);
    assert!(!said.contains("beyond all features"), "{said}");
    let file = folder.file("units", XGBOOST.replacen("[-1.5, ", "[-3072, ", 1).as_bytes());
    let beyond = "1 of 1 thresholds are beyond all features: was it trained on X times its scale?";
    says(&model(&["import", text(&file), "-o", out, "--force"]), 0, &[beyond]);
    for (leaves, option, numbers, says) in [
        ("-1, 1", &[][..], "int16", "proven to be those of float32"),
        ("-0.9765625E-3, 31.9990234375", &[], "int16", "proven"),
        ("-0.9765625E-3, 32.5", &[], "float32", "order of their sums are exact"),
        ("-1, 0.1", &[], "float32", "order of their sums are exact"),
        ("-1, 0.1", &["--leaves", "int16"], "int16", "a score is off by"),
        ("-1, 1", &["--leaves", "float32"], "float32", "order of their sums are exact"),
        ("-1, 1", &["--leaves", "auto"], "int16", "proven"),
    ] {
        let (found, said) = kept(leaves, option);
        assert!(found.contains(numbers) && said.contains(says), "{leaves} {option:?}: {found}; {said}");
    }
}

#[test]
fn one_class_is_the_answer_whatever_its_score() {
    let folder = Folder::new("one-class");
    let one = XGBOOST.replacen("binary:logistic", "multi:softprob", 1);
    let one = one.replacen("\"num_class\": \"0\"", "\"num_class\": \"1\"", 1);
    let (file, out) = (folder.file("one.json", one.as_bytes()), folder.0.join("one.wsm"));
    good(&["import", text(&file), "-o", text(&out), "--labels", "Saw3"]);
    // Not zeros, which would be no samples.
    let data = npz(&[array_x("(2, 700)", &[[257; 700]; 2]), array_of("y", 4, "Saw3Saw3")]);
    let found = json(&["eval", text(&out), text(&folder.file("data.npz", data))]);
    assert_eq!((&found["n"], &found["right"], &found["answered"]), (&2.into(), &2.into(), &2.into()), "{found}");
    assert_eq!((&found["accuracy"], &found["predictions"]), (&1.0.into(), &json!(["Saw3", "Saw3"])));
}

#[test]
fn trees_that_are_left_out_are_said() {
    let folder = Folder::new("best-iteration");
    // A second tree, after the best iteration.
    let (before, tree) = XGBOOST.split_once("\"trees\": [").unwrap();
    let (tree, after) = tree.split_once("]}},").unwrap();
    let two = format!("{before}\"trees\": [{tree}, {tree}]}}}},{after}")
        .replacen("\"attributes\": {}", "\"attributes\": {\"best_iteration\": \"0\"}", 1)
        .replacen("\"tree_info\": [0]", "\"tree_info\": [0, 0]", 1);
    let (file, out) = (folder.file("two.json", two.as_bytes()), folder.0.join("two.wsm"));
    says(&model(&["import", text(&file), "-o", text(&out)]), 0, &["1 of 2 trees are used"]);
}

/// The names of a model's own classes are in the demo of the tests of escapes.
#[test]
fn the_demo_compares_what_the_model_tells_apart() {
    let folder = Folder::new("demo");
    let (file, out) = (folder.file("trained", XGBOOST.as_bytes()), folder.path("out.wsm"));
    for (labels, title, unit) in [("Fla,Saw", "pattern", ""), ("0,3", "depth", " mm")] {
        good(&["import", text(&file), "-o", &out, "--labels", labels, "--force"]);
        let said = printed(&run(&["demo", "--model", &out]));
        assert!(said.lines().nth(1).unwrap().contains(&format!("direction    {title} ")), "{said}");
        let is_right = |row: &str| {
            let (specimen, answer) = (&row[..4], row.split('°').nth(1).unwrap().trim_start());
            let mut names = labels.split(',').filter(|label| answer.starts_with(&format!("{label}{unit}")));
            let name = names.next().unwrap_or_else(|| panic!("{said}"));
            if title == "depth" { specimen[3..] == *name } else { specimen.starts_with(name) }
        };
        let right = said.lines().skip(2).take(12).filter(|row| is_right(row)).count();
        let last = said.lines().last().unwrap();
        assert!(right > 0 && last.ends_with(&format!("; {right} of 12 {title}s right, 0 unknown")), "{said}");
    }
}
