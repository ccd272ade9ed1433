//! Tests the shipped models of the path on slides of sensors that no model has seen.

use std::fs;
use std::path::PathBuf;

use wstac_core::model::Model;
use wstac_core::model::file::Input;
use wstac_train::dataset::path::{PathSlide, RandomSlides};

/// Least number of right answers of 300: three standard deviations below the accuracy that README.md of the models has.
const LEAST: [(&str, Input, usize); 8] = [
    ("path-svm", Input::Path, 288),
    ("path-forest", Input::Path, 270),
    ("path-boosted", Input::Path, 283),
    ("taxel-path-svm", Input::TaxelPath, 297),
    ("taxel-path-forest", Input::TaxelPath, 297),
    ("taxel-path-boosted", Input::TaxelPath, 297),
    ("path-svm-16mm", Input::Path, 284),
    ("taxel-path-svm-16mm", Input::TaxelPath, 294),
];

fn words(name: &str) -> Vec<u32> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../wstac-host/models/path/{name}.wsm"));
    fs::read(file).unwrap().as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

#[test]
fn models_of_the_path_name_textures_of_unseen_sensors() {
    let wanted = RandomSlides { slides: 300, seed: 77_001, sensors: [400_000, 1000], ..RandomSlides::default() };
    let slides = wanted.all().unwrap();
    for (name, input, least) in LEAST {
        let words = words(name);
        let model = Model::from_words(&words).unwrap();
        assert_eq!(model.input(), input, "{name}");
        let is_right = |slide: &&PathSlide| {
            let sample = if input == Input::Path { slide.path } else { slide.taxel_path };
            sample.is_some_and(|sample| {
                let class = model.classify(sample.numbers());
                sample.covers(model.frames())
                    && model.labels().get(class.into()).is_some_and(|label| {
                        let specimen = slide.slide.specimen;
                        label == *format!("{}{}", specimen.pattern.name(), specimen.depth_mm)
                    })
            })
        };
        let right = slides.iter().filter(is_right).count();
        println!("{name}: {right} of 300");
        assert!(right >= least, "{name}: {right} of 300, expected at least {least}");
    }
}
