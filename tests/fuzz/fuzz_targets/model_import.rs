//! Imports any bytes as a trained model: XGBoost's JSON or UBJSON, or ONNX. The result is an error with a message, or a
//! valid model file that answers.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wstac_core::model::Model;
use wstac_train::model::{Import, import_bytes};

fuzz_target!(|data: &[u8]| {
    match import_bytes("fuzz", data.to_vec(), &Import::default()) {
        Err(why) => assert!(!why.is_empty()),
        Ok((trained, written)) => {
            let model = Model::from_words(&written.words).expect("what is written is a model file");
            assert_eq!(model.labels().len(), trained.labels.len());
            for sample in [[0; 700], [i16::MIN; 700], [i16::MAX; 700]] {
                assert!(usize::from(model.classify(&sample)) < trained.labels.len());
            }
        }
    }
});
