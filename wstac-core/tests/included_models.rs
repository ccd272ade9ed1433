//! Models that are compiled in. The documentation of `include_model!` shows that a damaged one does not compile.
#![allow(missing_docs)]

use wstac_core::include_model;
use wstac_core::model::Model;
use wstac_core::model::forest::Forest;

static FOREST: Forest<'static> = include_model!(Forest, "models/small.wsm");
static ANY: Model<'static> = include_model!(Model, "models/small.wsm");

#[test]
fn a_model_that_is_compiled_in_is_the_one_that_is_loaded() {
    let bytes = include_bytes!("models/small.wsm");
    let words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let loaded = Model::from_words(&words).unwrap();
    assert_eq!(FOREST.labels().len(), loaded.labels().len());
    let mut sample = [0; 700];
    for x in i16::MIN..=i16::MAX {
        sample.fill(x);
        let class = loaded.classify(&sample);
        assert_eq!((FOREST.classify(&sample), ANY.classify(&sample)), (class, class), "{x}");
    }
}
