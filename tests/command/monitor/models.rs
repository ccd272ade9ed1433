//! Tests `wstac board --model`: a model reaches a board whatever the line loses, and what the board refuses is told.

use serde_json::{Value, json};
use wstac_core::model::file::{INPUTS, Input, Task};
use wstac_core::wire::{
    AcceptedModels, BoardModel, Message, ModelId, ModelKind, ModelRefusal, ModelStep, Request, SettingsInUse,
};
use wstac_host::model_file::ModelFile;
use wstac_tests::command::{refused, said};
use wstac_tests::folder::Folder;
use wstac_train::model::trained::{Kind, Linear, Row, Trained};
use wstac_train::model::write::{Options, Weights, write};

use super::board::Sent;
use super::settings::{Board, compiled_in};

/// The damage of a model on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Line {
    /// All arrives.
    Whole,
    /// The piece at this byte is lost once.
    Loses(u32),
    /// The answer to the piece at this byte is lost once, and then comes twice.
    Forgets(u32),
    /// The board starts again once before this byte.
    Restarts(u32),
    /// The board does not say which layout of model files it reads.
    Old,
    /// The board refuses the model after the last piece.
    Refuses(ModelRefusal),
}

const ACCEPTS: AcceptedModels =
    AcceptedModels { kind: ModelKind::LinearSvm, input: Input::Frames, most: 256 * 1024 - 64 };

/// Answers as a firmware that takes models does. It starts again when it is asked for its settings.
fn takes(line: Line, accepts: AcceptedModels) -> impl FnMut(Request, &mut Sent) + Send + 'static {
    let (mut used, mut step) = (None::<u32>, ModelStep::Rest);
    let (mut bytes, mut is_done) = (Vec::<u8>::new(), false);
    move |request, sent| {
        let mut answers = 1;
        match request {
            Request::Settings => {
                match step {
                    ModelStep::Kept(model) => (used, step) = (Some(model.checksum), ModelStep::Rest),
                    ModelStep::Forgotten => (used, step) = (None, ModelStep::Rest),
                    _ => {}
                }
                sent.push(&Message::Settings(SettingsInUse::new(compiled_in(), false)));
                answers = 0;
            }
            Request::Textures => answers = 0,
            Request::Model => {}
            Request::SendModel(model) => {
                if !matches!(step, ModelStep::Wants { model: other, .. } if other == model) {
                    bytes.clear();
                    step = ModelStep::Wants { model, at: 0 };
                }
            }
            Request::ModelPiece(piece) => {
                let is_first = !is_done && !matches!(line, Line::Whole | Line::Refuses(_));
                match line {
                    Line::Loses(at) if is_first && at == piece.at() => (answers, is_done) = (0, true),
                    Line::Restarts(at) if is_first && at == piece.at() => (step, is_done) = (ModelStep::Rest, true),
                    _ => {
                        if let Line::Forgets(at) = line
                            && at == piece.at()
                        {
                            answers = if is_first { 0 } else { 2 };
                            is_done = true;
                        }
                        take(piece.at(), piece.bytes(), &mut bytes, &mut step, line);
                    }
                }
            }
            Request::ForgetModel => step = ModelStep::Forgotten,
            other => panic!("{other:?}"),
        }
        for _ in 0..answers {
            let mut state = BoardModel::new(used, used.is_some(), accepts, step);
            state.layout = state.layout.filter(|_| line != Line::Old);
            sent.push(&Message::Model(state));
        }
    }
}

/// Takes a piece if it is the next one. The whole model must be the file.
fn take(at: u32, piece: &[u8], bytes: &mut Vec<u8>, step: &mut ModelStep, line: Line) {
    let ModelStep::Wants { model, at: next } = *step else { return };
    if at != next {
        return;
    }
    bytes.extend(piece);
    let at = bytes.len() as u32;
    *step = ModelStep::Wants { model, at };
    if at == model.bytes {
        assert!(*bytes == file_bytes(), "another file has arrived");
        *step = match line {
            Line::Refuses(refusal) => ModelStep::Refused(refusal),
            _ => ModelStep::Kept(model),
        };
    }
}

fn file_bytes() -> Vec<u8> {
    let file = ModelFile::open("builtin:svm".as_ref()).unwrap();
    file.words().iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn id() -> ModelId {
    let bytes = file_bytes();
    ModelId { bytes: bytes.len() as u32, checksum: u32::from_le_bytes(bytes[4..8].try_into().unwrap()) }
}

fn in_use(name: &Value) -> Value {
    let checksum = name.as_str().map(|_| format!("{:08X}", id().checksum));
    let is_sent = !name.is_null();
    json!({"checksum": checksum, "name": name, "sent": is_sent, "kind": "linear_svm", "input": "frames", "most": 262_080})
}

#[test]
fn a_model_is_sent_shown_and_forgotten() {
    let board = Board::that(takes(Line::Whole, ACCEPTS));
    assert_eq!(board.json(&[])["model"], in_use(&Value::Null));
    let done = board.run(&["--model", "builtin:svm"]);
    let words = said(&done);
    assert!(words.starts_with(&format!("wstac: 0 of {} bytes of the model are sent\n", id().bytes)), "{words}");
    assert!(words.contains("wstac: the board uses the model builtin:svm\n"), "{words}");
    assert_eq!(words.matches("bytes of the model").count(), 11, "{words}");
    let text = String::from_utf8(done.stdout).unwrap();
    let last = format!("# Its texture model was sent: builtin:svm, checksum {:08X}.\n", id().checksum);
    assert!(text.ends_with(&last), "{text}");
    assert_eq!(board.json(&[])["model"], in_use(&json!("builtin:svm")));
    assert_eq!(board.json(&["--forget-model"])["model"], in_use(&Value::Null));
}

#[test]
fn a_piece_an_answer_or_a_start_that_is_lost_does_not_matter() {
    for line in [Line::Loses(0), Line::Forgets(1600), Line::Restarts(1600)] {
        let board = Board::that(takes(line, ACCEPTS));
        assert_eq!(board.json(&["--model", "builtin:svm"])["model"], in_use(&json!("builtin:svm")), "{line:?}");
    }
}

#[test]
fn a_model_that_the_board_does_not_take_is_refused_with_the_reason() {
    let with = |change: fn(&mut AcceptedModels)| {
        let mut accepts = ACCEPTS;
        change(&mut accepts);
        Board::that(takes(Line::Whole, accepts))
    };
    let size = format!("it has {} bytes, expected 1 to 1000", id().bytes);
    for (board, reason) in [
        (with(|accepts| accepts.kind = ModelKind::Forest), "it is of another kind, expected a forest"),
        (with(|accepts| accepts.input = Input::TaxelPath), "it takes another sample, expected taxel_path"),
        (with(|accepts| accepts.most = 1000), &size),
        (with(|accepts| accepts.most = 0), "the board has no memory for models"),
        (Board::that(takes(Line::Refuses(ModelRefusal::Damaged), ACCEPTS)), "it arrived damaged, or is no model"),
        (Board::that(takes(Line::Refuses(ModelRefusal::Memory), ACCEPTS)), "the board's memory for models failed"),
    ] {
        let expected = format!("builtin:svm: the board does not take it: {reason}");
        board.refuses(&["--model", "builtin:svm"], &expected);
    }
    let folder = Folder::new("board-models");
    let mut damaged = file_bytes();
    damaged[5000] ^= 1;
    let file = folder.written("damaged.wsm", damaged);
    // It is checked before the port is opened.
    refused(&["board", "/dev/nowhere", "--model", &file], &["its checksum is wrong"]);
}

/// Tests a board before version 0.4, whose state ends with the last step.
#[test]
fn a_board_of_0_3_gets_no_second_layout() {
    let row =
        |at: usize| Row { weights: (0..INPUTS).map(|input| f64::from(u8::from(input == at))).collect(), bias: 0.0 };
    let rows = vec![row(0), row(1)];
    let (labels, task, input) = (vec!["a".into(), "b".into()], Task::Other, Input::Frames);
    let kind = Kind::Linear(Linear { pairs: false, rows });
    let model = Trained { labels, task, input, inputs: INPUTS, speeds: None, kind, remarks: Vec::new(), mean: None };
    let options = Options { weights: Some(Weights::Int32), ..Options::default() };
    let folder = Folder::new("board-layout");
    let file = folder.written("wide.wsm", write(&model, "", options).unwrap().bytes());
    let old = Board::that(takes(Line::Old, ACCEPTS));
    old.refuses(&["--model", &file], "it is WSM2, and the firmware reads WSM1: build the firmware of this version");
    Board::that(takes(Line::Old, ACCEPTS)).json(&["--model", "builtin:svm"]);
}

#[test]
fn a_firmware_without_models_says_what_it_needs() {
    let board = Board::that(super::learning::learns(super::learning::Line::Whole));
    for option in [&["--model", "builtin:svm"][..], &["--forget-model"]] {
        board.refuses(option, "takes no models, expected a firmware with the feature models");
    }
}
