//! An open video node and its ioctls as safe methods. Only this file and `buffers` hold unsafe code.

use std::fs::{File, OpenOptions};
use std::io;
use std::mem;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;
use wstac_core::rate::FrameRate;

use super::color::Colorimetry;
use wstac_host::camera::formats::FourCc;
use wstac_host::camera::modes::{RateRange, SizeRange};
use wstac_host::error::{Error, ErrorKind};

/// The type of buffers of a single-planar capture device.
pub(super) const CAPTURE: u32 = sys::v4l2_buf_type_V4L2_BUF_TYPE_VIDEO_CAPTURE;

/// Most entries of a list that are read. A driver that never ends its list must not be asked forever.
const MOST_ENTRIES: u32 = 1024;

/// An open video node, in non-blocking mode.
#[derive(Debug)]
pub(crate) struct Device {
    pub(crate) file: File,
    pub(crate) path: PathBuf,
}

/// A device's identity and capabilities.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Identity {
    /// The maker's name for it.
    pub(crate) card: String,
    pub(crate) driver: String,
    /// The place where it is plugged in.
    pub(crate) bus: String,
    /// `V4L2_CAP_*` of this node.
    pub(crate) capabilities: u32,
}

/// The properties of the driver's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PictureFormat {
    /// The content of the buffers.
    pub(crate) fourcc: FourCc,
    /// Width and height in pixels.
    pub(crate) size: (u32, u32),
    /// Bytes from the start of a row to the start of the next; 0 if the driver does not say.
    pub(crate) bytes_per_row: u32,
    /// The meaning of Y, Cb, Cr.
    pub(crate) colorimetry: Colorimetry,
    /// Whether frames are whole pictures, not fields of an interlaced one.
    pub(crate) progressive: bool,
}

impl Device {
    /// Opens a video node.
    ///
    /// # Errors
    /// There is no such file, it is no device, or it may not be opened.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        // The file is examined first. Opening a named pipe could wait forever, and opening a tape would have an effect.
        let kind = std::fs::metadata(path).map_err(|error| explain(path, "cannot be opened", error))?.file_type();
        if !kind.is_char_device() {
            return Err(Error::new(
                ErrorKind::Unsupported,
                path.display(),
                "not a camera: expected a video device such as /dev/video0",
            ));
        }
        let file = OpenOptions::new().read(true).write(true).custom_flags(libc::O_NONBLOCK).open(path);
        let file = file.map_err(|error| explain(path, "cannot be opened", error))?;
        Ok(Self { file, path: path.to_owned() })
    }

    /// Creates an error that names this device.
    pub(crate) fn error(&self, what: &str, error: io::Error) -> Error {
        explain(&self.path, what, error)
    }

    /// Calls the driver, and repeats a call that a signal interrupted.
    pub(super) fn call<T: Copy>(&self, request: &Ioctl<T>, argument: &mut T) -> io::Result<()> {
        loop {
            // SAFETY: an `Ioctl<T>` promises that the kernel takes a `T` here and leaves a valid one. The pointer is
            // to one for the length of the call.
            let result = unsafe { v4l::v4l2::ioctl(self.file.as_raw_fd(), request.code, (&raw mut *argument).cast()) };
            match result {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => return other,
            }
        }
    }

    /// Returns its identity.
    ///
    /// # Errors
    /// The driver's error. It is ENOTTY if the file is no V4L2 device.
    pub(crate) fn identity(&self) -> io::Result<Identity> {
        let mut raw: sys::v4l2_capability = zeroed();
        self.call(&QUERYCAP, &mut raw)?;
        // The field `capabilities` is of the whole device with all its nodes. Older drivers know nothing else.
        let this_node = raw.capabilities & sys::V4L2_CAP_DEVICE_CAPS != 0;
        Ok(Identity {
            card: text(&raw.card),
            driver: text(&raw.driver),
            bus: text(&raw.bus_info),
            capabilities: if this_node { raw.device_caps } else { raw.capabilities },
        })
    }

    /// Returns the formats and their descriptions, in the driver's order.
    pub(super) fn formats(&self) -> Vec<(FourCc, String)> {
        self.listed(&ENUM_FMT, |raw: &mut sys::v4l2_fmtdesc, index| {
            raw.index = index;
            raw.type_ = CAPTURE;
        })
        .map(|raw| (raw.pixelformat.to_le_bytes(), text(&raw.description)))
        .collect()
    }

    /// Returns the frame sizes of a format; none if the driver does not list them.
    pub(super) fn sizes(&self, fourcc: FourCc) -> Vec<SizeRange> {
        self.listed(&ENUM_FRAMESIZES, |raw: &mut sys::v4l2_frmsizeenum, index| {
            raw.index = index;
            raw.pixel_format = u32::from_le_bytes(fourcc);
        })
        .map(|raw| {
            if raw.type_ == sys::v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE {
                // SAFETY: all fields are integers and the whole union was zeroed.
                let size = unsafe { raw.__bindgen_anon_1.discrete };
                return SizeRange::one(size.width, size.height);
            }
            // SAFETY: all fields are integers and the whole union was zeroed.
            let range = unsafe { raw.__bindgen_anon_1.stepwise };
            SizeRange {
                smallest: (range.min_width, range.min_height),
                largest: (range.max_width, range.max_height),
                step: (range.step_width.max(1), range.step_height.max(1)),
            }
        })
        .collect()
    }

    /// Returns the frame rates of a format at one size; none if the driver does not list them.
    pub(super) fn rates(&self, fourcc: FourCc, (width, height): (u32, u32)) -> Vec<RateRange> {
        self.listed(&ENUM_FRAMEINTERVALS, |raw: &mut sys::v4l2_frmivalenum, index| {
            raw.index = index;
            raw.pixel_format = u32::from_le_bytes(fourcc);
            (raw.width, raw.height) = (width, height);
        })
        .filter_map(|raw| {
            if raw.type_ == sys::v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE {
                // SAFETY: all fields are integers and the whole union was zeroed.
                let only = rate(unsafe { raw.__bindgen_anon_1.discrete })?;
                return Some(RateRange { slowest: only, fastest: only });
            }
            // SAFETY: all fields are integers and the whole union was zeroed.
            let range = unsafe { raw.__bindgen_anon_1.stepwise };
            // A bound that is not a fraction is ignored.
            let (slowest, fastest) = (rate(range.max), rate(range.min));
            Some(RateRange { slowest: slowest.or(fastest)?, fastest: fastest.or(slowest)? })
        })
        .collect()
    }

    /// Returns the driver's answers to the numbers 0, 1, … until it has no more.
    fn listed<T: Kernel>(&self, request: &Ioctl<T>, number: impl Fn(&mut T, u32)) -> impl Iterator<Item = T> {
        (0..MOST_ENTRIES).map_while(move |index| {
            let mut raw = zeroed();
            number(&mut raw, index);
            self.call(request, &mut raw).ok().map(|()| raw)
        })
    }

    /// Asks for a format and size, and returns those that the driver sets instead.
    pub(super) fn set_format(&self, fourcc: FourCc, size: (u32, u32)) -> io::Result<PictureFormat> {
        let mut pix: sys::v4l2_pix_format = zeroed();
        (pix.width, pix.height) = size;
        pix.pixelformat = u32::from_le_bytes(fourcc);
        pix.field = sys::v4l2_field_V4L2_FIELD_NONE;
        pix.priv_ = sys::V4L2_PIX_FMT_PRIV_MAGIC;
        let mut raw: sys::v4l2_format = zeroed();
        raw.type_ = CAPTURE;
        raw.fmt.pix = pix;
        self.call(&S_FMT, &mut raw)?;
        // SAFETY: all fields are integers, and `pix` was written before the call.
        let pix = unsafe { raw.fmt.pix };
        // SAFETY: the union's two fields are the same number under two names.
        let encoding = unsafe { pix.__bindgen_anon_1.ycbcr_enc };
        // Without the mark, the fields behind it were not filled in.
        let (encoding, quantization) =
            if pix.priv_ == sys::V4L2_PIX_FMT_PRIV_MAGIC { (encoding, pix.quantization) } else { (0, 0) };
        Ok(PictureFormat {
            fourcc: pix.pixelformat.to_le_bytes(),
            size: (pix.width, pix.height),
            bytes_per_row: pix.bytesperline,
            colorimetry: Colorimetry { colorspace: pix.colorspace, encoding, quantization },
            progressive: matches!(pix.field, sys::v4l2_field_V4L2_FIELD_ANY | sys::v4l2_field_V4L2_FIELD_NONE),
        })
    }

    /// Asks for a frame rate, and returns the one that the driver sets instead; `None` if it cannot set any.
    pub(super) fn set_rate(&self, rate: FrameRate) -> io::Result<Option<FrameRate>> {
        let mut raw: sys::v4l2_streamparm = zeroed();
        raw.type_ = CAPTURE;
        raw.parm.capture = zeroed();
        raw.parm.capture.timeperframe =
            sys::v4l2_fract { numerator: rate.denominator(), denominator: rate.numerator() };
        match self.call(&S_PARM, &mut raw) {
            Err(error) if !matches!(error.raw_os_error(), Some(libc::ENOTTY | libc::EINVAL)) => return Err(error),
            Err(_) => return Ok(None),
            Ok(()) => {}
        }
        // SAFETY: all fields are integers, and `capture` was written before the call.
        let capture = unsafe { raw.parm.capture };
        if capture.capability & sys::V4L2_CAP_TIMEPERFRAME == 0 {
            return Ok(None);
        }
        let interval = capture.timeperframe;
        Ok(FrameRate::new(interval.denominator, interval.numerator).ok())
    }

    /// Returns the frames per second of the digital video signal that the input is set to.
    pub(super) fn signal_rate(&self) -> Option<FrameRate> {
        let mut raw: sys::v4l2_dv_timings = zeroed();
        self.call(&G_DV_TIMINGS, &mut raw).ok()?;
        // SAFETY: all fields are integers and the whole union was zeroed.
        let bt = unsafe { raw.__bindgen_anon_1.bt };
        let sum = |parts: [u32; 4]| parts.iter().map(|part| u64::from(*part)).sum::<u64>();
        let width = sum([bt.width, bt.hfrontporch, bt.hsync, bt.hbackporch]);
        let mut height = sum([bt.height, bt.vfrontporch, bt.vsync, bt.vbackporch]);
        if bt.interlaced != 0 {
            height += sum([bt.il_vfrontporch, bt.il_vsync, bt.il_vbackporch, 0]);
        }
        let pixels = width.checked_mul(height).filter(|pixels| *pixels > 0)?;
        let clock = bt.pixelclock;
        let hundredths = u32::try_from((u128::from(clock) * 100 + u128::from(pixels) / 2) / u128::from(pixels)).ok()?;
        FrameRate::new(hundredths, 100).ok()
    }

    /// Returns whether the driver says that the selected input has no signal or no power.
    pub(crate) fn no_signal(&self) -> bool {
        let mut index: std::ffi::c_int = 0;
        let mut raw: sys::v4l2_input = zeroed();
        let asked = self.call(&G_INPUT, &mut index).and_then(|()| {
            raw.index = index as u32;
            self.call(&ENUMINPUT, &mut raw)
        });
        let bad = sys::V4L2_IN_ST_NO_POWER | sys::V4L2_IN_ST_NO_SIGNAL | sys::V4L2_IN_ST_NO_SYNC;
        asked.is_ok() && raw.status & bad != 0
    }
}

/// An ioctl that is called with a `T`.
pub(super) struct Ioctl<T> {
    code: vidioc::_IOC_TYPE,
    argument: std::marker::PhantomData<T>,
}

impl<T> Ioctl<T> {
    /// # Safety
    /// The kernel must take a `T` for this code. Any bytes of it must be valid, and it must hold no pointer that the
    /// kernel would follow.
    pub(super) const unsafe fn new(code: vidioc::_IOC_TYPE) -> Self {
        // The code has the size of the structure that the kernel reads and writes.
        assert!((code >> 16) as usize & 0x3fff == size_of::<T>(), "another type is expected by the kernel");
        Self { code, argument: std::marker::PhantomData }
    }
}

/// Declares requests by the kernel's name and its argument.
macro_rules! requests {
    ($($name:ident: $argument:ty = $code:expr;)*) => {
        $(
            // SAFETY: videodev2.h pairs this code with this type, which is made of integers only. Its unions hold
            // pointers for overlays and user memory, which nothing here uses.
            pub(super) const $name: Ioctl<$argument> = unsafe { Ioctl::new($code) };
        )*
    };
}

requests! {
    QUERYCAP: sys::v4l2_capability = vidioc::VIDIOC_QUERYCAP;
    ENUM_FMT: sys::v4l2_fmtdesc = vidioc::VIDIOC_ENUM_FMT;
    ENUM_FRAMESIZES: sys::v4l2_frmsizeenum = vidioc::VIDIOC_ENUM_FRAMESIZES;
    ENUM_FRAMEINTERVALS: sys::v4l2_frmivalenum = vidioc::VIDIOC_ENUM_FRAMEINTERVALS;
    S_FMT: sys::v4l2_format = vidioc::VIDIOC_S_FMT;
    S_PARM: sys::v4l2_streamparm = vidioc::VIDIOC_S_PARM;
    G_INPUT: std::ffi::c_int = vidioc::VIDIOC_G_INPUT;
    ENUMINPUT: sys::v4l2_input = vidioc::VIDIOC_ENUMINPUT;
    // The crate does not have this request: number 88, with the direction of S_PARM.
    G_DV_TIMINGS: sys::v4l2_dv_timings = (vidioc::VIDIOC_S_PARM & !0x3fff_00ff)
        | ((size_of::<sys::v4l2_dv_timings>() as vidioc::_IOC_TYPE) << 16)
        | 0x58;
    REQBUFS: sys::v4l2_requestbuffers = vidioc::VIDIOC_REQBUFS;
    QUERYBUF: sys::v4l2_buffer = vidioc::VIDIOC_QUERYBUF;
    QBUF: sys::v4l2_buffer = vidioc::VIDIOC_QBUF;
    DQBUF: sys::v4l2_buffer = vidioc::VIDIOC_DQBUF;
    STREAMON: std::ffi::c_int = vidioc::VIDIOC_STREAMON;
    STREAMOFF: std::ffi::c_int = vidioc::VIDIOC_STREAMOFF;
    QUERYCTRL: sys::v4l2_queryctrl = vidioc::VIDIOC_QUERYCTRL;
    QUERY_EXT_CTRL: sys::v4l2_query_ext_ctrl = vidioc::VIDIOC_QUERY_EXT_CTRL;
    G_CTRL: sys::v4l2_control = vidioc::VIDIOC_G_CTRL;
    S_CTRL: sys::v4l2_control = vidioc::VIDIOC_S_CTRL;
}

/// Returns a structure that the kernel takes, with every byte 0.
pub(super) fn zeroed<T: Kernel>() -> T {
    // SAFETY: `Kernel` promises that this is a value.
    unsafe { mem::zeroed() }
}

/// # Safety
/// All bytes 0 must be a valid value.
pub(super) unsafe trait Kernel: Copy {}

macro_rules! kernel {
    ($($structure:ident)*) => {
        $(
            // SAFETY: integers, and unions of integers and raw pointers.
            unsafe impl Kernel for sys::$structure {}
        )*
    };
}

kernel! {
    v4l2_capability v4l2_fmtdesc v4l2_frmsizeenum v4l2_frmivalenum v4l2_pix_format v4l2_format v4l2_captureparm
    v4l2_streamparm v4l2_dv_timings v4l2_input v4l2_requestbuffers v4l2_buffer v4l2_queryctrl v4l2_query_ext_ctrl v4l2_control
}

/// Returns the text before the first 0.
pub(super) fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

/// Returns the frames per second of a frame interval; `None` if it is no fraction above 0.
fn rate(interval: sys::v4l2_fract) -> Option<FrameRate> {
    FrameRate::new(interval.denominator, interval.numerator).ok()
}

/// Creates an error that says what to do about it.
fn explain(path: &Path, what: &str, error: io::Error) -> Error {
    let (kind, message) = match error.raw_os_error() {
        Some(libc::EBUSY) => (ErrorKind::Busy, format!("{what}: another program uses the camera")),
        Some(libc::ENODEV | libc::ENXIO) => {
            (ErrorKind::Device, format!("{what}: the camera is gone; was it unplugged?"))
        }
        Some(libc::EACCES | libc::EPERM) => (
            ErrorKind::Io,
            format!(
                "{what}: permission denied; add the user to the group video (sudo usermod -aG video NAME) and log in \
                 again"
            ),
        ),
        Some(libc::ENOENT) => (ErrorKind::NotFound, format!("{what}: no such file; wstac devices lists the cameras")),
        Some(libc::ENOTTY) => (ErrorKind::Unsupported, format!("{what}: not a video device")),
        _ => (ErrorKind::Device, format!("{what}: {error}")),
    };
    Error::new(kind, path.display(), message).caused_by(error)
}
