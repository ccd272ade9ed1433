use std::cell::RefCell;
use std::io;

use v4l::v4l_sys as sys;

use super::*;
use wstac_host::camera::LockedControl;

const AUTO: u32 = sys::V4L2_CID_EXPOSURE_AUTO;
const EXPOSURE: u32 = sys::V4L2_CID_EXPOSURE_ABSOLUTE;
const RATE: u32 = sys::V4L2_CID_EXPOSURE_AUTO_PRIORITY;
const WHITE_AUTO: u32 = sys::V4L2_CID_AUTO_WHITE_BALANCE;
const WHITE: u32 = sys::V4L2_CID_WHITE_BALANCE_TEMPERATURE;
const POWER: u32 = sys::V4L2_CID_POWER_LINE_FREQUENCY;
const ZOOM: u32 = sys::V4L2_CID_ZOOM_ABSOLUTE;

/// A camera like USB cameras: a control that something automatic governs refuses its value, and changes by itself.
struct Fake {
    controls: RefCell<Vec<(Control, i32)>>,
    /// The values that were set, in order.
    calls: RefCell<Vec<(u32, i32)>>,
    /// Controls that refuse to be set, and how.
    refuse: Vec<(u32, i32)>,
    /// Controls that take a value but keep their own.
    deaf: Vec<u32>,
    /// Controls that cannot be read.
    unreadable: Vec<u32>,
}

impl Fake {
    fn new() -> Self {
        let control =
            |id, name: &str, range, value| (Control { id, name: name.into(), range, step: 1, flags: 0 }, value);
        let controls = vec![
            control(WHITE_AUTO, "white_balance_automatic", (0, 1), 1),
            control(POWER, "power_line_frequency", (0, 2), 2),
            control(WHITE, "white_balance_temperature", (2000, 6500), 4000),
            control(AUTO, "auto_exposure", (0, 3), 3),
            control(EXPOSURE, "exposure_time_absolute", (3, 2047), 250),
            control(RATE, "exposure_dynamic_framerate", (0, 1), 1),
            control(ZOOM, "zoom_absolute", (100, 500), 100),
        ];
        let (refuse, deaf, unreadable) = (Vec::new(), Vec::new(), Vec::new());
        Self { controls: RefCell::new(controls), calls: RefCell::default(), refuse, deaf, unreadable }
    }

    fn flag(self, id: u32, flag: u32) -> Self {
        self.controls
            .borrow_mut()
            .iter_mut()
            .filter(|(control, _)| control.id == id)
            .for_each(|(c, _)| c.flags |= flag);
        self
    }

    fn value(&self, id: u32) -> i32 {
        self.controls.borrow().iter().find(|(control, _)| control.id == id).unwrap().1
    }

    fn lock(&self, settings: &[(&str, i32)]) -> Vec<LockedControl> {
        lock(self, &named(settings), false).unwrap()
    }

    fn change(&self, id: u32, value: i32) {
        self.controls.borrow_mut().iter_mut().filter(|(c, _)| c.id == id).for_each(|(_, old)| *old = value);
    }

    fn place(&self, id: u32) -> usize {
        let calls = self.calls.borrow();
        calls.iter().position(|(called, _)| *called == id).unwrap_or_else(|| panic!("{id:#x} was not set: {calls:?}"))
    }
}

impl Controls for Fake {
    fn list(&self) -> Vec<Control> {
        self.controls.borrow().iter().map(|(control, _)| control.clone()).collect()
    }

    fn get(&self, id: u32) -> io::Result<i32> {
        if self.unreadable.contains(&id) {
            return Err(io::Error::from_raw_os_error(libc::EIO));
        }
        Ok(self.value(id))
    }

    fn set(&self, id: u32, value: i32) -> io::Result<()> {
        self.calls.borrow_mut().push((id, value));
        if let Some((_, error)) = self.refuse.iter().find(|(refused, _)| *refused == id) {
            return Err(io::Error::from_raw_os_error(*error));
        }
        for (governor, manual, governed) in [(AUTO, 1, EXPOSURE), (WHITE_AUTO, 0, WHITE)] {
            if id == governed && self.value(governor) != manual {
                return Err(io::Error::from_raw_os_error(libc::EACCES));
            }
        }
        if !self.deaf.contains(&id) {
            self.change(id, value);
        }
        // Switching the automatic exposure off leaves the exposure as it was at that moment.
        if id == AUTO && value == 1 && !self.deaf.contains(&AUTO) {
            self.change(EXPOSURE, 333);
        }
        Ok(())
    }

    fn fixed(&self, _: u32) -> Option<i64> {
        None
    }
}

fn named(settings: &[(&str, i32)]) -> Vec<ControlSetting> {
    settings.iter().map(|(name, value)| ControlSetting { name: (*name).into(), value: *value }).collect()
}

fn one<'c>(controls: &'c [LockedControl], name: &str) -> &'c LockedControl {
    controls.iter().find(|control| control.name == name).unwrap()
}

fn why(controls: &[LockedControl], name: &str) -> String {
    let control = one(controls, name);
    assert!(!control.locked, "{control:?}");
    control.why.as_ref().unwrap().to_string()
}

#[test]
fn automatic_goes_off_before_the_value_is_set() {
    let camera = Fake::new();
    let locked = camera.lock(&[]);
    assert!(locked.iter().all(|control| control.locked && control.why.is_none()), "{locked:?}");
    // A steady rate comes first: the exposure is then no longer than a frame.
    assert!(camera.place(RATE) < camera.place(AUTO));
    assert!(camera.place(AUTO) < camera.place(EXPOSURE) && camera.place(WHITE_AUTO) < camera.place(WHITE));
    assert_eq!([AUTO, RATE, WHITE_AUTO, POWER].map(|id| camera.value(id)), [1, 0, 0, 0]);
    // It is the value at the moment when the automatic was switched off, not before.
    assert_eq!((camera.value(EXPOSURE), one(&locked, "exposure_time_absolute").value), (333, 333));
    assert_eq!(one(&locked, "white_balance_temperature").value, 4000);
    assert!(locked.iter().all(|control| control.name != "zoom_absolute"), "it changes no gray level by itself");
}

#[test]
fn a_second_time_nothing_changes() {
    let camera = Fake::new();
    let first = camera.lock(&[]);
    camera.calls.borrow_mut().clear();
    assert_eq!(camera.lock(&[]), first);
    assert!(camera.calls.borrow().iter().all(|(id, _)| [EXPOSURE, WHITE].contains(id)), "{:?}", camera.calls);
}

#[test]
fn users_values_are_set_after_the_automatic_is_off() {
    let camera = Fake::new();
    let locked = camera.lock(&[("exposure_time_absolute", 200), ("zoom_absolute", 150)]);
    assert_eq!((camera.value(EXPOSURE), camera.value(ZOOM)), (200, 150));
    assert!(one(&locked, "exposure_time_absolute").locked && one(&locked, "zoom_absolute").locked);
    // The last of two settings counts.
    camera.lock(&[("exposure_time_absolute", 200), ("exposure_time_absolute", 100)]);
    assert_eq!(camera.value(EXPOSURE), 100);
}

#[test]
fn what_users_leave_automatic_is_not_locked() {
    let camera = Fake::new();
    let locked = camera.lock(&[("auto_exposure", 3)]);
    assert_eq!(camera.value(AUTO), 3);
    assert!(why(&locked, "auto_exposure").contains("as asked"));
    assert_eq!(why(&locked, "exposure_time_absolute"), "auto_exposure is automatic");
    assert!(one(&locked, "white_balance_temperature").locked);
    let camera = Fake { refuse: vec![(AUTO, libc::EINVAL)], ..Fake::new() };
    assert!(why(&camera.lock(&[("auto_exposure", 2)]), "auto_exposure").starts_with("cannot be set: Invalid argument"));
}

#[test]
fn settings_that_fit_no_control_are_errors_that_list_what_there_is() {
    let error = |settings: &[(&str, i32)]| lock(&Fake::new(), &named(settings), false).unwrap_err();
    for (settings, parts) in [
        (("exposure", 1), ["exposure is not there", "exposure_time_absolute 3 to 2047", "auto_exposure 0 to 3"]),
        (("exposure_time_absolute", 2), ["is 2, expected 3 to 2047", "the camera has", "zoom_absolute 100 to 500"]),
    ] {
        let message = error(&[settings]);
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    let camera = Fake::new();
    camera.controls.borrow_mut().iter_mut().for_each(|(control, _)| control.step = 10);
    let message = lock(&camera, &named(&[("zoom_absolute", 155)]), false).unwrap_err();
    assert!(message.contains("in steps of 10"), "{message}");
    assert!(camera.calls.borrow().is_empty(), "nothing is changed before all is checked");
}

#[test]
fn what_the_driver_refuses_is_told_with_its_reason() {
    let camera = Fake { refuse: vec![(AUTO, libc::EINVAL)], ..Fake::new() };
    let locked = camera.lock(&[]);
    assert!(why(&locked, "auto_exposure").starts_with("cannot be switched off: Invalid argument"), "{locked:?}");
    assert_eq!(why(&locked, "exposure_time_absolute"), "auto_exposure is automatic");
    for (flag, reason) in
        [(sys::V4L2_CTRL_FLAG_READ_ONLY, "read-only"), (sys::V4L2_CTRL_FLAG_GRABBED, "another program holds it")]
    {
        let camera = Fake { refuse: vec![(AUTO, libc::EBUSY), (WHITE, libc::EBUSY)], ..Fake::new() };
        let locked = camera.flag(AUTO, flag).flag(WHITE, flag).lock(&[]);
        assert_eq!(why(&locked, "auto_exposure"), format!("cannot be switched off: {reason}"));
        assert_eq!(why(&locked, "white_balance_temperature"), format!("cannot be set: {reason}"));
    }
    let camera = Fake { refuse: vec![(WHITE, libc::EIO)], ..Fake::new() };
    assert!(why(&camera.lock(&[]), "white_balance_temperature").contains("Input/output error"));
}

#[test]
fn what_reads_back_otherwise_is_not_locked() {
    let camera = Fake { deaf: vec![AUTO, EXPOSURE], ..Fake::new() };
    let locked = camera.lock(&[]);
    assert_eq!(why(&locked, "auto_exposure"), "was switched off, but is not");
    let camera = Fake { deaf: vec![EXPOSURE], ..Fake::new() };
    let locked = camera.lock(&[("exposure_time_absolute", 200)]);
    assert_eq!(why(&locked, "exposure_time_absolute"), "set to 200, but reads back 333");
    assert_eq!(one(&locked, "exposure_time_absolute").value, 333);
    for (flag, reason) in [(sys::V4L2_CTRL_FLAG_VOLATILE, "volatile"), (sys::V4L2_CTRL_FLAG_INACTIVE, "inactive")] {
        let locked = Fake::new().flag(WHITE, flag).lock(&[]);
        assert!(why(&locked, "white_balance_temperature").starts_with(reason));
    }
    let camera = Fake { unreadable: vec![WHITE], ..Fake::new() };
    assert!(why(&camera.lock(&[]), "white_balance_temperature").starts_with("cannot be read"));
}

#[test]
fn a_switch_that_cannot_be_off_is_told_and_a_fixed_filter_is_locked() {
    let camera = Fake::new();
    for (control, _) in camera.controls.borrow_mut().iter_mut().filter(|(c, _)| [POWER, RATE].contains(&c.id)) {
        control.range.0 = 1;
    }
    let locked = camera.lock(&[]);
    assert!(one(&locked, "power_line_frequency").locked, "60 Hz stays 60 Hz");
    assert!(why(&locked, "exposure_dynamic_framerate").contains("the camera has 1 to 1"));
}

#[test]
fn kept_controls_are_left_alone() {
    let camera = Fake::new();
    let kept = lock(&camera, &named(&[("zoom_absolute", 150)]), true).unwrap();
    assert_eq!(*camera.calls.borrow(), [(ZOOM, 150)]);
    assert_eq!(why(&kept, "auto_exposure"), "left as it was");
    let expected = ("left as it was".into(), 250);
    assert_eq!((why(&kept, "exposure_time_absolute"), one(&kept, "exposure_time_absolute").value), expected);
    assert!(one(&kept, "zoom_absolute").locked);
    // A number that something automatic governs is not locked, unless that is off already.
    let white = named(&[("white_balance_temperature", 3000)]);
    let kept = lock(&Fake { refuse: vec![(WHITE, libc::EACCES)], ..Fake::new() }, &white, true).unwrap();
    assert_eq!(why(&kept, "white_balance_temperature"), "white_balance_automatic is automatic");
    let camera = Fake::new();
    camera.set(WHITE_AUTO, 0).unwrap();
    assert!(one(&lock(&camera, &white, true).unwrap(), "white_balance_temperature").locked);
}

#[test]
fn what_the_start_of_the_stream_changes_is_set_again() {
    let camera = Fake::new();
    let mut locked = camera.lock(&[]);
    for (id, value) in [(AUTO, 3), (EXPOSURE, 10), (WHITE, 5000)] {
        camera.change(id, value);
    }
    hold(&camera, &mut locked);
    assert_eq!((camera.value(AUTO), camera.value(EXPOSURE), camera.value(WHITE)), (1, 333, 4000));
    assert!(locked.iter().all(|control| control.locked), "{locked:?}");
    let camera = Fake { deaf: vec![WHITE], ..camera };
    camera.change(WHITE, 5000);
    hold(&camera, &mut locked);
    assert!(why(&locked, "white_balance_temperature").contains("when the stream started"));
    assert_eq!(one(&locked, "white_balance_temperature").value, 5000);
}

#[test]
fn names_are_spelt_as_v4l2_ctl_does() {
    for (name, expected) in [
        ("Exposure Time, Absolute", "exposure_time_absolute"),
        ("White Balance, Automatic", "white_balance_automatic"),
        ("  3A Lock (x) ", "3a_lock_x"),
    ] {
        assert_eq!(spelled(name), expected);
    }
}
