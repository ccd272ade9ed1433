//! Reads any bytes as a data set for `wstac model eval`. The result is an error that names the file, or an answer for
//! each sample.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use wstac_core::model::Model;
use wstac_train::model::eval::answers;
use wstac_train::model::{Import, import_bytes};

/// A tree with one split.
const TRAINED: &[u8] = include_bytes!("../seeds/model_import/xgboost.json");

static WORDS: LazyLock<Vec<u32>> =
    LazyLock::new(|| import_bytes("seed", TRAINED.to_vec(), &Import::default()).expect("the seed is a model").1.words);
/// Archives are files, so each process of the fuzzer has its own.
static PATH: LazyLock<PathBuf> =
    LazyLock::new(|| std::env::temp_dir().join(format!("wstac-fuzz-{}.npz", std::process::id())));

fuzz_target!(|data: &[u8]| {
    std::fs::write(&*PATH, data).expect("a temporary file");
    let model = Model::from_words(&WORDS).expect("the seed is a model");
    match answers(&model, &PATH) {
        Err(error) => assert!(error.to_string().contains("wstac-fuzz-")),
        Ok(answers) => assert!(answers.right().is_none_or(|right| right <= answers.predictions.len())),
    }
});
