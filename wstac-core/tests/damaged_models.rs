//! Damaged model files are refused because of their checksum. With a correct checksum they are refused or harmless.
#![allow(missing_docs)]

use wstac_core::model::Model;
use wstac_core::model::file::{INPUTS, ModelError, crc};
use wstac_random_models::{KINDS, MOST_WORDS, Maker};

/// Returns a small model of each kind, and samples.
fn small() -> Vec<(Vec<u32>, Vec<[i16; INPUTS]>)> {
    let (mut maker, mut words) = (Box::new(Maker::new(crc)), vec![0; MOST_WORDS]);
    (0..KINDS)
        .map(|kind| {
            let sizes = 80..400;
            let seed = (0..100).find(|&seed| sizes.contains(&maker.model(kind, seed, &mut words))).unwrap();
            let length = maker.model(kind, seed, &mut words);
            (words[..length].to_vec(), (0..4).map(|_| maker.sample()).collect())
        })
        .collect()
}

fn byte(words: &[u32], at: usize) -> u8 {
    words[at / 4].to_le_bytes()[at % 4]
}

fn with_byte(words: &mut [u32], at: usize, byte: u8) {
    let mut bytes = words[at / 4].to_le_bytes();
    bytes[at % 4] = byte;
    words[at / 4] = u32::from_le_bytes(bytes);
}

/// Returns whether a file is refused. A file that is not refused must answer with a class that it has.
fn refused(words: &[u32], samples: &[[i16; INPUTS]]) -> bool {
    let Ok(model) = Model::from_words(words) else { return true };
    for sample in samples {
        assert!(usize::from(model.classify(sample)) < model.labels().len());
    }
    (0..model.labels().len()).for_each(|class| assert!(model.labels().get(class).unwrap().chars().count() < 64));
    assert!(model.labels().training().chars().count() < 1 << 16);
    false
}

#[test]
fn every_changed_byte_is_found() {
    for (words, samples) in small() {
        assert!(!refused(&words, &samples));
        let mut changed = words.clone();
        for at in 0..4 * words.len() {
            let right = byte(&words, at);
            for wrong in (0..=u8::MAX).filter(|&wrong| wrong != right) {
                with_byte(&mut changed, at, wrong);
                let expected = match at {
                    0..3 => ModelError::Magic,
                    3 => ModelError::Version(wrong),
                    8..12 => ModelError::Length { found: words.len() as u32, expected: changed[2] },
                    _ => ModelError::Checksum { found: crc(&changed), expected: changed[1] },
                };
                assert_eq!(Model::from_words(&changed).err(), Some(expected), "{at} {wrong}");
            }
            with_byte(&mut changed, at, right);
        }
    }
}

#[test]
fn every_changed_byte_behind_a_right_checksum_is_refused_or_harmless() {
    let (mut bad, mut harmless) = (0, 0);
    for (words, samples) in small() {
        let mut changed = words.clone();
        for at in (0..4).chain(8..4 * words.len()) {
            let right = byte(&words, at);
            let flips = (0..8).map(|bit| right ^ 1 << bit);
            let others =
                [0, 0x7F, 0x80, 0xC0, 0xFF, right.wrapping_add(1), right.wrapping_sub(1), right.wrapping_mul(3)];
            for wrong in flips.chain(others) {
                with_byte(&mut changed, at, wrong);
                changed[1] = crc(&changed);
                *(if refused(&changed, &samples) { &mut bad } else { &mut harmless }) += 1;
            }
            with_byte(&mut changed, at, right);
        }
    }
    // Most bytes are thresholds, weights and leaves, for which any value will do.
    assert!(bad > 5000 && harmless > 5000, "{bad} {harmless}");
}

#[test]
fn every_truncation_is_refused() {
    for (words, samples) in small() {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        for length in 0..bytes.len() {
            assert!(Model::from_bytes(&bytes[..length]).is_err(), "{length}");
        }
        for length in 0..words.len() {
            let mut cut = words[..length].to_vec();
            assert!(Model::from_words(&cut).is_err());
            // Length and checksum are corrected, but its parts still reach beyond its end.
            if length > 2 {
                cut[2] = length as u32;
                cut[1] = crc(&cut);
                assert!(refused(&cut, &samples), "{length}");
            }
        }
    }
}
