//! Every kind of source opens by its name.

use std::fs;

use wstac_core::green::any::PixelFormat;

use crate::open;
use wstac_core::rate::FrameRate;
use wstac_host::camera::ControlSetting;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{Frame, SourceEvent};

fn message(spec: &str, options: &OpenOptions) -> String {
    open(spec, options).err().unwrap().to_string()
}

#[test]
fn every_kind_of_source_opens() {
    let folder = std::env::temp_dir().join(format!("wstac-open-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let y4m = b"YUV4MPEG2 W1 H1 F25:1 Cmono\nFRAME\nx";
    fs::write(path("clip.y4m"), y4m).unwrap();
    fs::write(path("clip.dat"), y4m).unwrap();
    fs::write(path("other.dat"), "other").unwrap();
    fs::write(path("empty.y4m"), "").unwrap();
    fs::write(path("s.toml"), "specimen = \"Saw3\"\nspeed = 150").unwrap();
    for name in ["clip.y4m", "clip.dat"] {
        let mut source = open(path(name), &OpenOptions::default()).unwrap();
        assert!(matches!(source.next_event(), Ok(SourceEvent::Frame(Frame { bytes: b"x", .. }))));
    }
    let scene = open(format!("scene:{}", path("s.toml")), &OpenOptions::default()).unwrap();
    assert!(scene.info().about.contains("Saw3 at 150 mm/s"), "{}", scene.info().about);
    let none = OpenOptions::default();
    let expected =
        "expected /dev/videoN, rpicam:, scene:…, a .y4m, .mcap or video file, a folder of PNGs or JPEGs, or -";
    let error = message(&path("other.dat"), &none);
    assert!(error.starts_with("SOURCE is \"") && error.contains(expected), "{error}");
    assert!(message(&path("empty.y4m"), &none).contains("is empty"));
    assert!(message(&path(""), &none).contains("no .png or .jpg file"));
    let error = message("nothing", &none);
    assert!(error.starts_with("SOURCE is \"nothing\": no such file; expected /dev/videoN"), "{error}");
    assert!(message("", &none).starts_with("SOURCE is \"\": no such file"));
    let sized = OpenOptions { size: Some((4, 4)), ..none.clone() };
    assert!(message(&path("clip.y4m"), &sized).contains("size is 4x4, expected only with a camera"));
    let format = OpenOptions { format: Some(*b"YUYV"), ..none.clone() };
    assert!(message(&path("clip.y4m"), &format).contains("format is YUYV, expected only with a camera"));
    let controls = vec![ControlSetting { name: "gain".into(), value: 3 }];
    let controlled = OpenOptions { controls, ..none.clone() };
    for spec in [&*path("clip.y4m"), "scene:Saw3@150", "-"] {
        let error = message(spec, &controlled);
        assert!(error.contains("control gain=3 is set, expected only with a camera"), "{error}");
    }
    assert!(message("/dev/null", &none).starts_with("/dev/null: "), "a device is taken for a camera");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn scenes_take_options() {
    let rate = FrameRate::new(60, 1).unwrap();
    let options =
        OpenOptions { fps: Some(rate), format: Some(*b"GREY"), size: Some((100, 80)), ..OpenOptions::default() };
    let source = open("scene:Saw3@150,90deg", &options).unwrap();
    assert_eq!((source.info().rate, source.info().size.width()), (rate, 100));
    assert!(message("scene:Saw3", &options).contains("scene:Saw3: slide is \"Saw3\", expected"));
    assert!(message("scene:no.toml", &options).contains("no.toml: no such file"));
    let yuyv = OpenOptions { format: Some(*b"YUYV"), ..options.clone() };
    assert_eq!(open("scene:Saw3@150", &yuyv).unwrap().info().format, PixelFormat::Yuyv);
    let format = OpenOptions { format: Some(*b"H264"), ..options.clone() };
    let error = message("scene:Saw3@150", &format);
    assert!(error.contains("H264") && error.contains("expected"), "{error}");
    let tiny = OpenOptions { size: Some((3, 3)), ..options.clone() };
    assert!(message("scene:Saw3@150", &tiny).contains("taxel size"));
}
