use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::*;

/// One code of every family.
const FORMATS: [&str; 20] = [
    "GREY", "Y10", "Y12", "Y16", "RGB3", "BGR3", "XR24", "XB24", "RGB4", "RX24", "RGBP", "RGGB", "GB10", "BG12",
    "YUYV", "UYVY", "NV12", "YU12", "422P", "MJPG",
];

fn config(format: &str, size: (u32, u32)) -> SensorConfig {
    let size = FrameSize::new(size.0, size.1).unwrap();
    SensorConfig { size, format: format.parse().unwrap(), ..SensorConfig::default() }
}

fn rendered(config: &SensorConfig) -> Sensor {
    Sensor::new(config, Fidelity::Rendered, 0.0, Rng::new(5, 3)).unwrap()
}

/// Returns the mean level of every taxel, in levels of 255.
fn levels(sensor: &mut Sensor, light: &[f64; TAXELS]) -> [f64; TAXELS] {
    let scale = f64::from(sensor.pixels()) * f64::from(sensor.full_scale()) / 255.0;
    sensor.sums(light).map(|sum| f64::from(sum) / scale)
}

#[test]
fn a_taxel_is_as_bright_as_it_is_told_to_be() {
    for format in FORMATS {
        for noise in [0.0, 1.0] {
            let mut sensor = rendered(&SensorConfig { noise, black_level: 3.0, ..config(format, (1280, 720)) });
            let mut light = [0.0; TAXELS];
            light[7] = 0.25;
            let levels = levels(&mut sensor, &light);
            // Few bits, the rounding of chroma (up to a level of green in all) and compression err alike everywhere.
            let most = match format {
                "RGBP" | "YUYV" | "UYVY" | "NV12" | "YU12" | "422P" | "MJPG" => 1.1,
                "RGGB" | "GB10" | "BG12" => 0.6,
                // Without noise the flat middle of a spot is rounded to the same value everywhere.
                _ if noise == 0.0 => 0.3,
                _ => 0.05,
            };
            assert!((levels[7] - 66.75).abs() < most, "{format}, noise {noise}: {levels:?}");
            assert!((levels[8] - 3.0).abs() < most, "{format}, noise {noise}: {levels:?}");
        }
    }
}

#[test]
fn light_that_is_no_light_and_light_without_end_do_no_harm() {
    for format in FORMATS {
        let mut sensor = rendered(&config(format, (160, 120)));
        let levels =
            levels(&mut sensor, &core::array::from_fn(|k| [f64::NAN, -1.0, f64::NEG_INFINITY, f64::INFINITY][k % 4]));
        assert!(levels[0] < 5.0 && levels[1] < 5.0 && levels[2] < 5.0 && levels[3] > 150.0, "{format}: {levels:?}");
    }
}

#[test]
fn only_taxels_are_written() {
    let inside = |layout: &Layout, x: usize, y: usize| {
        let [width, height] = layout.taxel().map(usize::from);
        layout.corners().iter().any(|corner| {
            let [left, top] = corner.map(usize::from);
            (left..left + width).contains(&x) && (top..top + height).contains(&y)
        })
    };
    for (format, bytes) in [("GREY", 1), ("Y12", 2), ("RGB3", 3), ("RGGB", 1), ("YUYV", 2), ("NV12", 1)] {
        let mut sensor = rendered(&config(format, (203, 107)));
        let (before, layout) = (sensor.expose(&[0.0; TAXELS]).to_vec(), *sensor.layout());
        let bytes_per_row = sensor.bytes_per_row();
        let after = sensor.expose(&[0.5; TAXELS]);
        assert_eq!(before.len(), after.len());
        for y in 0..107 {
            for x in 0..203 {
                let pixel = y * bytes_per_row + bytes * x..y * bytes_per_row + bytes * (x + 1);
                // The chroma of a pair reaches one pixel further.
                let near = inside(&layout, x, y) || format == "YUYV" && inside(&layout, x ^ 1, y);
                assert!(near || before[pixel.clone()] == after[pixel], "{format} {x} {y}");
            }
        }
    }
}

#[test]
fn every_frame_size_is_a_sensor_or_an_error() {
    for (width, height) in [(1, 1), (3, 3), (4, 4), (5, 5), (5, 1000), (37, 29), (1000, 7), (64, 63)] {
        for format in FORMATS {
            let config = SensorConfig { blur: 1.5, ..config(format, (width, height)) };
            let sensor = Sensor::new(&config, Fidelity::Rendered, 0.01, Rng::new(0, 0));
            // Taxels of a mosaic hold a cell.
            let least = if ["RGGB", "GB10", "BG12"].contains(&format) { 12 } else { 4 };
            assert_eq!(sensor.is_ok(), width.min(height) >= least, "{format} {width} {height}");
            if let Ok(mut sensor) = sensor {
                let bytes = sensor.expose(&[0.5; TAXELS]).len();
                assert_eq!(bytes, sensor.camera.frame_bytes());
                sensor.sums(&[1.0; TAXELS]);
            }
        }
    }
}

#[test]
fn what_cannot_be_is_an_error() {
    for format in ["YUYV", "NV12", "MJPG"] {
        let error = Sensor::new(&config(format, (100, 100)), Fidelity::Taxel, 0.0, Rng::new(0, 0)).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(&format!("format is {format}")) && message.contains("\"taxel\""), "{message}");
    }
    let wrong = SensorConfig { gain: 0.0, ..SensorConfig::default() };
    assert!(Sensor::new(&wrong, Fidelity::Rendered, 0.0, Rng::new(0, 0)).is_err());
    let large = config("Y16", (16_384, 16_384));
    assert!(Sensor::new(&large, Fidelity::Taxel, 0.0, Rng::new(0, 0)).unwrap_err().to_string().contains("32 bits"));
}

#[test]
fn auto_exposure_and_options_that_are_carried_change_no_byte() {
    let plain = config("GREY", (100, 100));
    let rate = FrameRate::new(60, 1).unwrap();
    let carried = SensorConfig { exposure: 0.5, dropped: 0.1, auto_exposure: true, quality: 3, rate, ..plain.clone() };
    assert_eq!(rendered(&plain).expose(&[0.1; TAXELS]), rendered(&carried).expose(&[0.1; TAXELS]));
}

/// Computes an FNV-1a hash.
fn hash(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

/// Returns light from dark to beyond saturation.
fn slope(frame: u32) -> [f64; TAXELS] {
    core::array::from_fn(|k| 0.06 * k as f64 * f64::from(frame))
}

/// Checks hashes that were made on x86-64; any other machine must make the same bytes.
#[test]
fn a_seed_gives_the_same_bytes_everywhere() {
    let expected: [(&str, u64); 13] = [
        ("GREY", 0x84AD_5762_7367_7E0C),
        ("Y10", 0x4944_A039_E8C6_5251),
        ("Y16", 0xBEF6_B9EC_6E63_DEDB),
        ("RGB3", 0xFF4B_BAF1_DAD9_DAB1),
        ("XR24", 0x7BF1_6BAE_9153_0C98),
        ("RGBP", 0x85BE_382C_AE1C_9CC6),
        ("RGGB", 0x668E_549D_9A33_735F),
        ("GB10", 0x42F1_95F7_9D9D_E988),
        ("YUYV", 0xD761_0620_E3B0_9B31),
        ("NV12", 0xF9A7_7F4C_BC7A_4D4E),
        ("YU12", 0xA09C_E9D9_FD81_CC84),
        ("422P", 0xAF41_ED59_E8DF_1075),
        ("MJPG", 0x7683_99A4_EE59_1825),
    ];
    let found = expected.map(|(format, _)| {
        let config = SensorConfig { blur: 0.8, gain: 1.5, ..config(format, (75, 61)) };
        let mut sensor = Sensor::new(&config, Fidelity::Rendered, 0.002, Rng::new(7, 1)).unwrap();
        (format, hash((0..3).flat_map(|frame| sensor.expose(&slope(frame)).to_vec())))
    });
    assert_eq!(found, expected, "{found:#X?}");
}

#[test]
fn a_seed_gives_the_same_sums_everywhere() {
    let expected: [(&str, u64); 4] = [
        ("GREY", 0x807F_E519_1ECD_7507),
        ("Y12", 0xBA47_6135_2158_E714),
        ("RGBP", 0x774E_7320_AA66_DDD1),
        ("BG12", 0x7FC2_685C_B998_7F86),
    ];
    let found = expected.map(|(format, _)| {
        let config = SensorConfig { blur: 0.8, gain: 1.5, ..config(format, (75, 61)) };
        let mut sensor = Sensor::new(&config, Fidelity::Taxel, 0.002, Rng::new(7, 1)).unwrap();
        (format, hash((0..30).flat_map(|frame| sensor.sums(&slope(frame))).flat_map(u32::to_le_bytes)))
    });
    assert_eq!(found, expected, "{found:#X?}");
}

/// Returns the mean and variance of the sums in levels of 255, over frames and taxels.
fn statistics(config: &SensorConfig, fidelity: Fidelity, light: f64, frames: u32) -> [f64; 2] {
    let mut sensor = Sensor::new(config, fidelity, 0.001, Rng::new(11, fidelity as u64)).unwrap();
    let all: Vec<f64> = (0..frames).flat_map(|_| levels(&mut sensor, &[light; TAXELS])).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    [mean, all.iter().map(|level| (level - mean) * (level - mean)).sum::<f64>() / (all.len() as f64 - 1.0)]
}

/// Checks the numbers in the documentation of [`Sensor::sums`].
#[test]
fn drawn_sums_are_distributed_as_rendered_ones() {
    let config = |format, change: fn(&mut SensorConfig)| {
        let mut config = config(format, (300, 240));
        change(&mut config);
        config
    };
    let (mut worst_mean, mut worst_variance) = (0.0_f64, 0.0_f64);
    for config in [
        config("GREY", |_| ()),
        config("GREY", |c| (c.gain, c.blur) = (8.0, 3.0)),
        config("GREY", |c| c.noise = 0.3),
        config("GREY", |c| c.noise = 0.05),
        config("GREY", |c| c.noise = 0.0),
        config("GREY", |c| (c.full_well, c.read_noise, c.black_level) = (3000.0, 40.0, 0.0)),
        config("Y10", |c| c.blur = 1.0),
        config("Y12", |c| (c.gain, c.noise) = (2.0, 2.0)),
        config("Y16", |_| ()),
        config("RGB3", |_| ()),
        config("RGBP", |c| c.read_noise = 200.0),
        config("RGGB", |_| ()),
        config("GB10", |c| c.gain = 4.0),
    ] {
        for light in [0.0, 0.003, 0.1, 0.6, 3.0, 1e5] {
            let about = format!("{} gain {} noise {}, light {light}", config.format, config.gain, config.noise);
            let render = statistics(&config, Fidelity::Rendered, light, 240);
            let drawn = statistics(&config, Fidelity::Taxel, light, 240);
            let samples = 240.0 * TAXELS as f64;
            let chance = 4.0 * ((render[1] + drawn[1]) / samples).sqrt();
            let off = (render[0] - drawn[0]).abs();
            assert!(off < 0.02 + chance, "{about}: mean {} drawn, {} rendered", drawn[0], render[0]);
            worst_mean = worst_mean.max(off);
            // If nearly no pixel ever changes, a sum's own rounding is as large as its standard deviation.
            if render[1].max(drawn[1]) > 1e-9 {
                let ratio = drawn[1] / render[1];
                assert!((ratio - 1.0).abs() < 0.15 + 4.0 * (4.0 / samples).sqrt(), "{about}: variance {ratio} times");
                worst_variance = worst_variance.max((ratio - 1.0).abs());
            }
        }
    }
    println!("drawn and rendered sums: means off by {worst_mean:.4} levels, variances by {worst_variance:.3}");
}
