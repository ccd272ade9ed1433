//! Entry points for messages between a board and a host.

use wstac_core::features::Floor;
use wstac_core::law::{Answer, AnyLaw, ByCoherence, ByEdges};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::model::Model;
use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::speed::SpeedConfig;
use wstac_core::paper::trigger::Event;
use wstac_core::paper::trigger::TriggerConfig;
use wstac_core::texture;
use wstac_core::touch::motion::Velocity;
use wstac_core::wire::{
    self, AcceptedModels, Answers, BoardModel, DecodeError, Decoder, Learning, LearningStep, Message, ModelPiece,
    ModelStep, Outbox, PictureEnd, PicturePart, Received, Refusal, Request, Settings, SettingsInUse, Text, TextureName,
};

entries! {
    wire:
    encode<'b>(message: &Message<'_>, sequence: u16, buffer: &'b mut [u8; wire::LONGEST]) -> &'b [u8] {
        wire::encode(message, sequence, buffer)
    }
    encode_request<'b>(request: &Request, sequence: u16, buffer: &'b mut [u8; wire::LONGEST]) -> &'b [u8] {
        wire::encode(request, sequence, buffer)
    }
    new_decoder() -> Decoder { Decoder::new() }
    decode<'a>(decoder: &'a mut Decoder, byte: u8) -> Option<Result<Received<Message<'a>>, DecodeError>> {
        decoder.push(byte)
    }
    decode_request(decoder: &mut Decoder<{ wire::LONGEST_REQUEST }>, byte: u8) -> Option<Result<Received<Request>, DecodeError>> {
        decoder.push(byte)
    }
    picture_part<'a>(bytes: &'a [u8], first: u32) -> PicturePart<'a> { PicturePart::new(0, 0, first, bytes) }
    picture_checksum(part: &PicturePart<'_>) -> u32 { part.checksum() }
    picture_end(parts: u16, checksum: u32) -> PictureEnd { PictureEnd::new(0, parts, checksum) }
    settings(layout: &Layout, floor: Floor, trigger: TriggerConfig) -> Settings {
        Settings::new(layout, floor, trigger, None)
    }
    settings_layout(settings: &Settings, size: FrameSize) -> Result<Layout, Refusal> { settings.layout(size) }
    settings_in_use(settings: Settings) -> SettingsInUse { SettingsInUse::new(settings, true) }
    texture_name(text: &str) -> Option<TextureName> { TextureName::new(text) }
    texture_name_text<'a>(name: &'a TextureName) -> &'a str { name.as_str() }
    learning(name: TextureName, step: LearningStep) -> (Learning, bool) {
        (Learning::new(name, 0, 5, step), step.is_end())
    }
    model_piece(at: u32, bytes: &[u8]) -> Option<ModelPiece> { ModelPiece::new(at, bytes) }
    model_piece_bytes<'a>(piece: &'a ModelPiece) -> (u32, &'a [u8]) { (piece.at(), piece.bytes()) }
    board_model(accepts: AcceptedModels, step: ModelStep) -> BoardModel {
        BoardModel::new(Some(1), true, accepts, step)
    }
    text<'a>(text: &'a str) -> Text<'a> { Text::new(text) }
    text_length(text: &Text<'_>) -> usize { if text.is_empty() { 0 } else { text.len() } }
    answers(event: &Event<'_>, config: &SpeedConfig) -> Answers<'static> { Answers::new(event, config) }
    answers_of(event: &Event<'_>, answer: &Answer) -> Answers<'static> { Answers::of(event, answer) }
    exclude(speeds: KnownSpeeds, velocity: Option<Velocity>) -> bool { speeds.exclude(velocity) }
    last_frame(answers: &Answers<'_>) -> u64 { answers.last_frame() }
    has_texture(answers: &Answers<'_>) -> bool { answers.has_texture() }
    velocity_of_answers(answers: &Answers<'_>) -> Option<Velocity> { answers.velocity() }
    touch_frame(answers: &Answers<'_>) -> Option<u64> { answers.touch_frame() }
    end_frame(answers: &Answers<'_>) -> Option<u64> { answers.end_frame() }
    texture<'a>(answers: Answers<'a>, sample: &[i16; 700], model: &Model<'a>) -> Answers<'a> {
        answers.with_texture(texture::texture(sample, model))
    }
    new_outbox() -> Outbox<'static> { Outbox::new() }
    outbox_push(outbox: &mut Outbox<'static>, answers: Answers<'static>, now: u32) -> Answers<'static> {
        outbox.push(answers, now)
    }
    outbox_due(outbox: &mut Outbox<'static>, now: u32) -> Option<Answers<'static>> { outbox.due(now) }
    outbox_answer(outbox: &mut Outbox<'static>, request: Request) -> () {
        outbox.answer(request);
    }
    outbox_state(outbox: &Outbox<'static>, event: u16) -> (u16, u8, bool, bool) {
        (outbox.next_event(), outbox.kept(), outbox.keeps(event), outbox.is_heard())
    }
    sample<'b>(sample: Sample<'_>, part: usize, buffer: &'b mut [u8; wire::LONGEST]) -> &'b [u8] {
        wire::sample_parts(0, sample).nth(part).map_or(&[], |part| wire::encode(&part, 0, buffer))
    }
}

entries! {
    law:
    wire_answers_by_coherence(event: &Event<'_>, law: &ByCoherence) -> Answers<'static> { Answers::new(event, law) }
    wire_answers_by_edges(event: &Event<'_>, law: &ByEdges) -> Answers<'static> { Answers::new(event, law) }
}

entries! {
    any_law:
    wire_answers_by_any(event: &Event<'_>, law: &AnyLaw) -> Answers<'static> { Answers::new(event, law) }
}
