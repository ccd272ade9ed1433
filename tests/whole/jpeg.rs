//! The green of pictures that libjpeg-turbo has made, compared with what it decodes; `tests/jpeg/make.py` has both.

use std::fs;
use std::path::PathBuf;

use wstac_core::layout::FrameSize;
use wstac_host::camera::mjpeg::Decoder;

const WIDTH: usize = 29;
const HEIGHT: usize = 21;
/// The tolerances of docs/SPEC.md, in levels: of a pixel, and of a taxel's mean.
const PIXEL: i32 = 3;
const MEAN: f64 = 0.75;

fn folder() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "jpeg"].iter().collect()
}

fn decode(bytes: &[u8]) -> Result<Vec<u8>, &'static str> {
    let size = FrameSize::new(WIDTH as u32, HEIGHT as u32).unwrap();
    Decoder::new(size).decode(bytes).map(|rgb| rgb.iter().skip(1).step_by(3).copied().collect())
}

#[test]
fn green_is_that_of_libjpeg() {
    let mut read = 0;
    for file in fs::read_dir(folder()).unwrap().map(|file| file.unwrap().path()) {
        let name = file.file_stem().unwrap().to_str().unwrap();
        if file.extension().is_none_or(|end| end != "jpg") || ["420-arithmetic", "420-separate"].contains(&name) {
            continue;
        }
        let green = decode(&fs::read(&file).unwrap()).unwrap_or_else(|why| panic!("{name}: {why}"));
        let kind = name.split(['-', '+']).next().unwrap();
        let expected = fs::read(folder().join(format!("{kind}.pgm"))).unwrap();
        let expected = &expected[expected.len() - WIDTH * HEIGHT..];
        // Of every pixel, and of 5 x 5 parts as taxels.
        let mut parts = [[(0, 0); 5]; 5];
        for (at, (green, expected)) in green.iter().zip(expected).enumerate() {
            let (x, y, off) = (at % WIDTH, at / WIDTH, i32::from(*green) - i32::from(*expected));
            assert!(off.abs() <= PIXEL, "{name}: off by {off} at {x}, {y}");
            let part = &mut parts[y * 5 / HEIGHT][x * 5 / WIDTH];
            *part = (part.0 + off, part.1 + 1);
        }
        for (sum, count) in parts.into_iter().flatten() {
            assert!(f64::from(sum).abs() <= MEAN * f64::from(count), "{name}: {sum} in {count} pixels");
        }
        read += 1;
    }
    assert_eq!(read, 18);
}

#[test]
fn pictures_that_are_not_decoded_say_why() {
    for (name, why) in [
        ("420-arithmetic", "its coding is arithmetic"),
        ("420-separate", "its components are in separate scans, and have different sizes"),
    ] {
        assert_eq!(decode(&fs::read(folder().join(format!("{name}.jpg"))).unwrap()).unwrap_err(), why);
    }
    let mut cmyk = fs::read(folder().join("444.jpg")).unwrap();
    let start = cmyk.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    cmyk.splice(start + 3..start + 10, [20, 8, 0, HEIGHT as u8, 0, WIDTH as u8, 4, 4, 0x11, 0]);
    assert_eq!(decode(&cmyk).unwrap_err(), "it has neither 1 nor 3 components, such as CMYK");
}
