//! Small pictures of frames: those of any pixel format look alike.

use wstac_host::picture::{Picture, Sampler};
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::source::{Frame, SourceEvent};
use wstac_scene::source::Scenes;

/// Returns the picture of a frame in the middle of a slide, in a format, and its mean light.
fn lit(format: &str) -> (Picture, f32) {
    let format = format.as_bytes().try_into().ok();
    let options = OpenOptions { format, size: Some((200, 160)), ..OpenOptions::default() };
    let mut source = open("scene:Saw3@150", &options, &[&Scenes]).unwrap();
    let sampler = Sampler::new(source.info());
    for _ in 0..59 {
        source.next_event().unwrap();
    }
    let SourceEvent::Frame(Frame { bytes, .. }) = source.next_event().unwrap() else { panic!("no frame") };
    let picture = sampler.picture(bytes);
    let light = picture.light.iter().sum::<f32>() / picture.light.len() as f32;
    (picture, light)
}

#[test]
fn every_format_shows_the_same_picture() {
    let (gray, light) = lit("GREY");
    assert_eq!((gray.size, gray.light.len()), ([200, 160], 200 * 160));
    assert!(light > 0.01, "{light}");
    for format in ["Y16 ", "RGGB", "YUYV", "NV12", "YU12", "RGBP", "RGB3"] {
        let (picture, light_there) = lit(format);
        let side = if format == "RGGB" { [100, 80] } else { [200, 160] };
        assert_eq!(picture.size, side, "{format}");
        assert!((light_there - light).abs() < 0.15 * light, "{format}: {light_there}, expected {light}");
        let [a, b] = [&gray, &picture].map(|picture| picture.scaled([20, 16]));
        let most = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most < 0.1, "{format}: off by {most}");
    }
}
