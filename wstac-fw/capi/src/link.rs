//! Messages to a host, as `wstac monitor` reads them: each call writes the bytes of one message, and the program sends
//! them.

use core::ffi::{CStr, c_char};

use wstac_core::law::{Answer, EventLaw};
use wstac_core::model::Model;
use wstac_core::model::file::Task;
use wstac_core::paper::direction::{Direction, Heading};
use wstac_core::paper::speed::Speed;
use wstac_core::paper::trigger::{ContactEnd, Event, InterruptedSample, StreamEnd};
use wstac_core::params::SAMPLE_FRAMES;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_core::wire::{
    self, Answers, Decoder, Hello, Message, ModelFacts, Outbox, Request, SAMPLE_PART, Telemetry, Text, TextureAnswer,
    Wanted,
};

use crate::answers::{
    WstacFwContact, WstacFwContactEnd, WstacFwDirection, WstacFwIncomplete, WstacFwMotion, WstacFwSpeed, WstacFwWhy,
};
use crate::format::WstacFwFormat;
use crate::memory::{Memory, borrowed, bytes as borrowed_bytes, fits, give, place, set_up, value, value_mut};
use crate::model::{WSTAC_FW_LABEL_BYTES, WstacFwModel, WstacFwTask, WstacFwTexture};
use crate::pipeline::{PipelineState, WstacFwPipeline};
use crate::status::{WstacFwStatus, choice, status};

/// The number of bytes of the longest message.
pub const WSTAC_FW_LINK_BYTES: usize = 314;

const _: () = assert!(WSTAC_FW_LINK_BYTES == wire::LONGEST);

/// The number of messages that carry a sample.
pub const WSTAC_FW_SAMPLE_PARTS: u32 = 7;

const _: () = assert!(WSTAC_FW_SAMPLE_PARTS as usize * SAMPLE_PART == SAMPLE_FRAMES);

/// The number of bytes of a link.
pub const WSTAC_FW_LINK_SIZE: usize = 696;

/// A link to a host, in memory that the program provides: `static WstacFwLink link;`. A serial line needs one.
///
/// wstac_fw_link_init sets it up. It counts messages, events and lost frames, and keeps the last two events until the
/// host has them. Nothing has to be freed.
#[repr(C)]
pub struct WstacFwLink {
    /// Private to the library.
    opaque: [u64; 87],
}

/// The state of a link.
pub(crate) struct Sender {
    dropped: u64,
    sequence: u16,
    /// The milliseconds of the last wstac_fw_link_due.
    now: u32,
    /// The bytes of a request, as far as they have arrived.
    decoder: Decoder<LONGEST_REQUEST>,
    wanted: Wanted,
    /// The events that were sent and not acknowledged, without their textures.
    outbox: Outbox<'static, KEPT>,
    /// The textures of events that are kept. Others may be left from events that are not kept any more.
    textures: [Option<(u16, WstacFwTexture)>; KEPT],
}

/// The number of bytes of the longest request that a board in C reads. Others are ignored.
const LONGEST_REQUEST: usize = 16;

/// The number of events that are kept.
const KEPT: usize = 2;

const _: () = assert!(size_of::<WstacFwLink>() == WSTAC_FW_LINK_SIZE);
// On a 64-bit machine, where tests run, pointers are larger.
const _: () = assert!(fits::<WstacFwLink, Sender>(if cfg!(target_pointer_width = "32") { 104 } else { 0 }));

// SAFETY: it consists of numbers, as large and aligned as asserted above.
unsafe impl Memory for WstacFwLink {
    type Value = Sender;
    const MARK: u32 = u32::from_le_bytes(*b"WSln");
}

impl Sender {
    fn new() -> Self {
        Self {
            dropped: 0,
            sequence: 0,
            now: 0,
            decoder: Decoder::new(),
            wanted: Wanted::default(),
            outbox: Outbox::new(),
            textures: [const { None }; KEPT],
        }
    }

    /// Keeps the texture of an event that the outbox has just taken, as long as the outbox keeps the event.
    fn keep_texture(&mut self, event: u16, texture: WstacFwTexture) {
        let Self { outbox, textures, .. } = self;
        // The outbox has a place for the event, so one here has no event, or one that is not kept any more.
        let is_free = |place: &Option<(u16, _)>| !place.as_ref().is_some_and(|(other, _)| outbox.keeps(*other));
        if let Some(place) = textures.iter_mut().find(|place| is_free(place)) {
            *place = Some((event, texture));
        }
    }

    /// Returns the texture of an event that is kept.
    fn texture_of(&self, event: u16) -> Option<&WstacFwTexture> {
        self.textures.iter().flatten().find(|(kept, _)| *kept == event).map(|(_, texture)| texture)
    }

    /// Writes the bytes of a message.
    ///
    /// # Safety
    /// `out` has memory for WSTAC_FW_LINK_BYTES bytes and for one number.
    unsafe fn write(&mut self, message: &Message<'_>, out: &Out) -> Result<WstacFwStatus, WstacFwStatus> {
        let mut buffer = [0; WSTAC_FW_LINK_BYTES];
        let bytes = wire::encode(message, self.sequence, &mut buffer);
        self.sequence = self.sequence.wrapping_add(1);
        // SAFETY: there is memory for all of them (the caller), and none of it is in the buffer.
        unsafe { out.bytes.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        // SAFETY: the caller guarantees it.
        unsafe { give(out.length, bytes.len()) }
    }

    /// Takes a request of the host. Returns whether it asks for a description of the board.
    fn answer(&mut self, request: Request) -> bool {
        match request {
            Request::Hello => return true,
            Request::Features(wanted) => self.wanted.features = wanted,
            Request::Samples(wanted) => self.wanted.samples = wanted,
            // Others are about events, or about what this library does not do.
            request => self.outbox.answer(request),
        }
        false
    }
}

/// The requests of a host.
#[repr(C)]
pub struct WstacFwWanted {
    /// Whether the host has asked for wstac_fw_link_hello since the last call.
    pub hello: bool,
    /// Whether it wants wstac_fw_link_features of every frame.
    pub features: bool,
    /// Whether it wants wstac_fw_link_sample before every event.
    pub samples: bool,
    /// Whether it acknowledges events. Then the link keeps them until it has.
    pub events_kept: bool,
}

/// The description of a board. Texts are UTF-8 with a 0 at the end; longer ones than stated are cut.
#[repr(C)]
pub struct WstacFwBoard {
    /// The name of the firmware, of at most 31 bytes.
    pub firmware: *const c_char,
    /// The version of the firmware, of at most 31 bytes.
    pub version: *const c_char,
    /// The revision of the firmware's source, of at most 15 bytes; null if it is not known.
    pub revision: *const c_char,
    /// The pixel format: the one that the pipeline was set up with.
    pub format: *const WstacFwFormat,
    /// The texture model; null without one.
    pub model: *const WstacFwModel,
    /// The unique number of the chip in three words, its lowest word first; null if it has none.
    pub id: *const u32,
}

/// The answers of an event: a motion, or a speed and a direction as published. The others are null.
#[repr(C)]
pub struct WstacFwAnswers {
    /// The motion, from wstac_fw_motion or wstac_fw_motion_by_edges; null by the published law.
    pub motion: *const WstacFwMotion,
    /// The speed, from wstac_fw_speed; null with a motion.
    pub speed: *const WstacFwSpeed,
    /// The direction, from wstac_fw_direction; null with a motion.
    pub direction: *const WstacFwDirection,
    /// The texture, from wstac_fw_classify; null without one. Only a slide has one.
    pub texture: *const WstacFwTexture,
}

/// The state of a board. -1 means that a number is not known.
#[repr(C)]
pub struct WstacFwTelemetry {
    /// The milliseconds since the start.
    pub uptime_ms: u64,
    /// The measured frame rate in frames per 1000 seconds.
    pub millihertz: i64,
    /// The number of frames that were lost because pixels came faster than they were taken.
    pub overruns: i64,
    /// The number of starts since power was on, without the first.
    pub restarts: i64,
    /// The greatest depth of the stack in bytes.
    pub stack: i64,
}

/// Sets a link up in `size` bytes of memory: sizeof(WstacFwLink).
///
/// # Safety
/// `link` is null or that memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_init(link: *mut WstacFwLink, size: usize) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    status(unsafe { set_up(link, size, || Ok(Sender::new())) })
}

/// The place for the bytes of a message.
struct Out {
    bytes: *mut u8,
    length: *mut usize,
}

impl Out {
    /// Checks that there is a place for both.
    fn checked(&self) -> Result<Self, WstacFwStatus> {
        Ok(Self { bytes: place(self.bytes)?, length: place(self.length)? })
    }
}

/// Writes the bytes of a message of this link.
///
/// # Safety
/// `link` is null or a link's memory, and `out` has null or memory for WSTAC_FW_LINK_BYTES bytes and for one number.
unsafe fn send<'m>(
    link: *mut WstacFwLink,
    out: &Out,
    message: impl FnOnce(&mut Sender) -> Result<Message<'m>, WstacFwStatus>,
) -> WstacFwStatus {
    let send = || {
        let out = out.checked()?;
        // SAFETY: the caller guarantees it.
        let sender = unsafe { value_mut(link) }?;
        let message = message(sender)?;
        // SAFETY: the caller guarantees it.
        unsafe { sender.write(&message, &out) }
    };
    status(send())
}

/// Returns the text of a program.
///
/// # Safety
/// `text` is null, or has a 0 at its end.
unsafe fn text<'a, const MOST: usize>(text: *const c_char) -> Result<Text<'a, MOST>, WstacFwStatus> {
    if text.is_null() {
        return Err(WstacFwStatus::Null);
    }
    // SAFETY: the caller guarantees it.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map(Text::new).map_err(|_| WstacFwStatus::Text)
}

/// Writes the bytes of the message that describes the board: the first one after the start. Later ones do no harm.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory, and `board` is null or a board whose
/// pointers are as its comments say. `bytes` is null or memory for WSTAC_FW_LINK_BYTES bytes, and `length` is null or
/// memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_hello(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    board: *const WstacFwBoard,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let hello = |_: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let state = unsafe { value(pipeline) }?;
        // SAFETY: the caller guarantees it.
        let board = unsafe { borrowed(board) }?;
        // SAFETY: the caller guarantees it.
        let format = unsafe { WstacFwFormat::checked(board.format) }?;
        let mut models = [None; 3];
        if !board.model.is_null() {
            // SAFETY: the caller guarantees it.
            let model: &Model<'static> = unsafe { value(board.model) }?;
            let classes = model.labels().len().min(usize::from(u8::MAX)) as u8;
            models[0] = Some(ModelFacts::new(model.task(), classes, model.frames()));
        }
        let revision = if board.revision.is_null() {
            Text::new("")
        } else {
            // SAFETY: the caller guarantees it.
            unsafe { text(board.revision) }?
        };
        let id = if board.id.is_null() {
            None
        } else {
            // SAFETY: the caller guarantees it.
            Some(*unsafe { borrowed(board.id.cast::<[u32; 3]>()) }?)
        };
        let geometry = state.pipeline.geometry();
        Ok(Message::Hello(Hello {
            // SAFETY: the caller guarantees it.
            firmware: unsafe { text(board.firmware) }?,
            // SAFETY: the caller guarantees it.
            version: unsafe { text(board.version) }?,
            size: geometry.layout().frame(),
            format: format.pixels,
            rate: geometry.rate(),
            trigger: *state.pipeline.trigger_config(),
            models,
            frame: state.pipeline.next_frame(),
            revision,
            id,
        }))
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, hello) }
}

/// Gives answers that were computed before.
struct Given(Answer);

impl EventLaw for Given {
    fn answer(&self, _: &Event<'_>) -> Answer {
        self.0
    }
}

/// Returns the answer of a law of arrival times.
fn by_arrival(motion: &WstacFwMotion, event: &Event<'_>) -> Result<Answer, WstacFwStatus> {
    const SLIDE: i32 = WstacFwContact::Slide as i32;
    const PRESS: i32 = WstacFwContact::Press as i32;
    const POKE: i32 = WstacFwContact::Poke as i32;
    let contact = match motion.contact {
        SLIDE => Contact::Slide,
        PRESS => Contact::Press,
        POKE => Contact::Poke,
        _ => Contact::Unclear,
    };
    let (speed, direction) = if contact == Contact::Slide {
        (Ok(Speed::by_arrival(motion.mm_s, motion.mm_s_sd)), Ok([motion.degrees, motion.degrees_sd]))
    } else {
        (Err(Reason::NoSlide(contact)), Err(Reason::NoSlide(contact)))
    };
    let reliable = choice(motion.reliable)?;
    let mut answer = Answer::new(speed, Direction::by_arrival(direction), reliable);
    (answer.contact, answer.duration) = (Some(contact), event.lit_frames());
    // Hosts refuse a reliable answer with a reason against it.
    answer.doubt = if reliable { None } else { WstacFwWhy::reason(motion.why) };
    Ok(answer)
}

/// Returns the answer of a law of durations.
fn by_duration(speed: &WstacFwSpeed, direction: &WstacFwDirection, event: &Event<'_>) -> Result<Answer, WstacFwStatus> {
    const THERE: i32 = WstacFwWhy::There as i32;
    let extrapolated = choice(speed.extrapolated)?;
    let found = match speed.why {
        THERE => {
            let mut found = Speed::new(speed.mm_s);
            found.extrapolated = extrapolated;
            Ok(found)
        }
        why if why == WstacFwWhy::BaselineAbove as i32 => Err(Reason::BaselineAbove),
        why if why == WstacFwWhy::CutOff as i32 => {
            Err(Reason::CutOff { at_most: Some(speed.at_most_mm_s).filter(|&mm_s| mm_s > 0.0) })
        }
        why if why == WstacFwWhy::OutsideLaw as i32 => Err(Reason::OutsideLaw),
        why => Err(WstacFwWhy::reason(why).unwrap_or(Reason::NeverValid)),
    };
    let heading = match (direction.why, direction.degrees) {
        (THERE, 0) => Ok(Heading::Right),
        (THERE, 90) => Ok(Heading::Up),
        (THERE, 180) => Ok(Heading::Left),
        (THERE, 270) => Ok(Heading::Down),
        (why, _) if why == WstacFwWhy::NeverLit as i32 => Err(Reason::NeverLit),
        _ => Err(Reason::NoOrder),
    };
    let mut answer = Answer::new(found, Direction::by_centroids(heading, direction.confidence), event.reliable);
    answer.duration = u8::try_from(speed.duration_frames).ok();
    Ok(answer)
}

/// Returns the answer of a texture model. Its name is read where it lies.
fn in_wire(texture: &WstacFwTexture) -> Result<TextureAnswer<'_>, WstacFwStatus> {
    // SAFETY: a character is a byte.
    let label = unsafe { &*(&raw const texture.label).cast::<[u8; WSTAC_FW_LABEL_BYTES]>() };
    let label = CStr::from_bytes_until_nul(label).map_err(|_| WstacFwStatus::Text)?;
    let label = label.to_str().map_err(|_| WstacFwStatus::Text)?;
    let task = match texture.task {
        WstacFwTask::Specimen => Task::Specimen,
        WstacFwTask::Pattern => Task::Pattern,
        WstacFwTask::Depth => Task::Depth,
        WstacFwTask::Other => Task::Other,
    };
    let mut answer = TextureAnswer::new(task, Text::new(label));
    answer.confidence = u16::try_from(texture.confidence).ok();
    answer.known = match texture.known {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    };
    Ok(answer)
}

/// Writes the bytes of the message of the event that the last push completed, with its answers. Events are counted.
///
/// If the host acknowledges events, wstac_fw_link_due writes the message again until the host has it.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory, and `answers` is null or answers whose
/// pointers are null or what their comments say. `bytes` is null or memory for WSTAC_FW_LINK_BYTES bytes, and `length`
/// is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_event(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    answers: *const WstacFwAnswers,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let event = |sender: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let state: &PipelineState = unsafe { value(pipeline) }?;
        // SAFETY: the caller guarantees it.
        let given = unsafe { borrowed(answers) }?;
        let event = state.event().ok_or(WstacFwStatus::State)?;
        let answer = if given.motion.is_null() {
            // SAFETY: the caller guarantees it.
            let speed = unsafe { borrowed(given.speed) }?;
            // SAFETY: the caller guarantees it.
            by_duration(speed, unsafe { borrowed(given.direction) }?, &event)?
        } else {
            // SAFETY: the caller guarantees it.
            by_arrival(unsafe { borrowed(given.motion) }?, &event)?
        };
        let texture = if given.texture.is_null() {
            None
        } else {
            // SAFETY: the caller guarantees it, and the texture outlives the call.
            let texture = unsafe { borrowed(given.texture) }?;
            Some((texture, in_wire(texture)?))
        };
        // It is numbered when nothing can fail any more.
        let mut answers: Answers<'_> = sender.outbox.push(Answers::new(&event, &Given(answer)), sender.now);
        if let Some((texture, in_wire)) = texture {
            if sender.outbox.is_heard() {
                sender.keep_texture(answers.number, *texture);
            }
            answers = answers.with_texture(in_wire);
        }
        Ok(Message::Event(answers))
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, event) }
}

/// Takes bytes that the host has sent, as they arrive: requests and acknowledgments. Writes what the host wants.
///
/// Damaged and unknown requests are ignored. A program that never calls it sends each event once.
///
/// # Safety
/// `link` is null or a link's memory, `bytes` is null or `length` bytes, and `wanted` is null or memory for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_receive(
    link: *mut WstacFwLink,
    bytes: *const u8,
    length: usize,
    wanted: *mut WstacFwWanted,
) -> WstacFwStatus {
    let receive = || {
        let wanted = place(wanted)?;
        // SAFETY: the caller guarantees it.
        let received = unsafe { borrowed_bytes(bytes, length) }?;
        // SAFETY: the caller guarantees it.
        let sender = unsafe { value_mut(link) }?;
        let mut hello = false;
        for &byte in received {
            let request = match sender.decoder.push::<Request>(byte) {
                Some(Ok(received)) => received.message,
                _ => continue,
            };
            hello |= sender.answer(request);
        }
        let Wanted { features, samples, .. } = sender.wanted;
        let found = WstacFwWanted { hello, features, samples, events_kept: sender.outbox.is_heard() };
        // SAFETY: the caller guarantees it.
        unsafe { give(wanted, found) }
    };
    status(receive())
}

/// Writes the bytes of the message of an event that the host has not acknowledged in time.
///
/// Call it in every round of the program's loop, with the milliseconds of a clock, which may wrap.
///
/// Returns WSTAC_FW_STATUS_NONE, and writes nothing, if there is none. An event is sent again after 250 ms, for at most
/// 4 seconds.
///
/// # Safety
/// `link` is null or a link's memory. `bytes` is null or memory for WSTAC_FW_LINK_BYTES bytes, and `length` is null or
/// memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_due(
    link: *mut WstacFwLink,
    now_ms: u32,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let due = || {
        let out = Out { bytes, length }.checked()?;
        // SAFETY: the caller guarantees it.
        let sender = unsafe { value_mut(link) }?;
        sender.now = now_ms;
        let mut answers: Answers<'_> = sender.outbox.due(now_ms).ok_or(WstacFwStatus::None)?;
        let texture = sender.texture_of(answers.number).copied();
        if let Some(texture) = &texture {
            answers = answers.with_texture(in_wire(texture)?);
        }
        // SAFETY: the caller guarantees it.
        unsafe { sender.write(&Message::Event(answers), &out) }
    };
    status(due())
}

/// Writes the bytes of the message of a part of the sample of the event that the last push completed.
///
/// All WSTAC_FW_SAMPLE_PARTS parts, from 0 on, come before the event.
///
/// Returns WSTAC_FW_STATUS_NONE, and writes nothing, if there is no such part.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_sample(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    part: u32,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let message = |_: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let state: &PipelineState = unsafe { value(pipeline) }?;
        let event = state.event().ok_or(WstacFwStatus::State)?;
        wire::sample_parts(event.frame, event.sample).nth(part as usize).ok_or(WstacFwStatus::None)
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, message) }
}

/// Writes the bytes of the message of the features of the frame that the last call completed.
///
/// Returns WSTAC_FW_STATUS_NONE, and writes nothing, if the last call completed none.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_features(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let message = |_: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let (frame, features) = unsafe { value(pipeline) }?.features.ok_or(WstacFwStatus::None)?;
        Ok(Message::Features { frame, features })
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, message) }
}

/// Writes the bytes of the message that the touch of an event has ended, from wstac_fw_take_contact_end. It comes after
/// the event.
///
/// # Safety
/// `link` is null or a link's memory, `end` is null or an end. `bytes` is null or memory for WSTAC_FW_LINK_BYTES
/// bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_contact_end(
    link: *mut WstacFwLink,
    end: *const WstacFwContactEnd,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let message = |_: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let end = unsafe { borrowed(end) }?;
        Ok(Message::ContactEnd(ContactEnd::new(end.frame, end.event_frame)))
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, message) }
}

/// Writes the bytes of the message of a sample that a long gap has interrupted, from wstac_fw_take_interrupted.
///
/// # Safety
/// `link` is null or a link's memory, `sample` is null or a sample. `bytes` is null or memory for WSTAC_FW_LINK_BYTES
/// bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_interrupted(
    link: *mut WstacFwLink,
    sample: *const WstacFwIncomplete,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let message = |_: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let sample = unsafe { borrowed(sample) }?;
        Ok(Message::InterruptedSample(InterruptedSample::new(sample.frame, sample.frames)))
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, message) }
}

/// Writes the bytes of the message that camera frames were lost. Call it with every wstac_fw_push_lost.
///
/// # Safety
/// `link` is null or a link's memory, and no other code uses it meanwhile. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_lost(
    link: *mut WstacFwLink,
    frames: u64,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let message = |sender: &mut Sender| {
        sender.dropped = sender.dropped.saturating_add(frames);
        Ok(Message::Lost { frames })
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, message) }
}

/// Writes the bytes of a message about the state of a pipeline's stream.
///
/// # Safety
/// As of [`send`], and `pipeline` is null or a pipeline's memory.
unsafe fn send_state(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    out: &Out,
    message: fn(StreamEnd, u64) -> Message<'static>,
) -> WstacFwStatus {
    let state = |sender: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let stream = unsafe { value(pipeline) }?.pipeline.end();
        Ok(message(stream, sender.dropped))
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, out, state) }
}

/// Writes the bytes of the message of the stream's state. Send it about once per second, with and without frames: a
/// silent board is a lost board.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_status(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    unsafe { send_state(link, pipeline, &Out { bytes, length }, |stream, dropped| Message::Status { stream, dropped }) }
}

/// Writes the bytes of the message that the stream has ended, after wstac_fw_finish. It is the last one.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_end(
    link: *mut WstacFwLink,
    pipeline: *const WstacFwPipeline,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    // SAFETY: the caller guarantees it.
    unsafe { send_state(link, pipeline, &Out { bytes, length }, |stream, dropped| Message::End { stream, dropped }) }
}

/// Writes the bytes of the message of the board's own state.
///
/// # Safety
/// `link` is null or a link's memory, `telemetry` is null or a state. `bytes` is null or memory for WSTAC_FW_LINK_BYTES
/// bytes, and `length` is null or memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_link_telemetry(
    link: *mut WstacFwLink,
    telemetry: *const WstacFwTelemetry,
    bytes: *mut u8,
    length: *mut usize,
) -> WstacFwStatus {
    let message = |sender: &mut Sender| {
        // SAFETY: the caller guarantees it.
        let given = unsafe { borrowed(telemetry) }?;
        let known = |number: i64| u32::try_from(number).ok();
        let mut state = Telemetry::default();
        state.uptime_ms = given.uptime_ms;
        (state.millihertz, state.overruns) = (known(given.millihertz), known(given.overruns));
        (state.restarts, state.stack) = (known(given.restarts), known(given.stack));
        (state.events, state.kept) = (sender.outbox.next_event(), sender.outbox.kept());
        state.wanted = sender.wanted;
        state.wanted.kept_events = sender.outbox.is_heard();
        Ok(Message::Telemetry(state))
    };
    // SAFETY: the caller guarantees it.
    unsafe { send(link, &Out { bytes, length }, message) }
}
