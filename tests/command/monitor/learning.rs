//! Tests `wstac board --learn`: a board learns a texture from slides, and tells what it makes of each touch.

use serde_json::json;
use wstac_core::wire::{
    LearnedTextures, Learning, LearningStep, Message, NotLearned, NotTaken, Request, SettingsInUse, TextureName,
};
use wstac_tests::command::{printed, said, says};

use super::board::Sent;
use super::settings::{Board, compiled_in};

/// The loss of messages about learning on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// All arrive.
    Whole,
    /// The one about this number of slides is lost.
    Loses(u8),
    /// The board starts again after this number of slides.
    Restarts(u8),
    /// The board has as many textures as it can.
    Full,
}

/// Answers as a firmware that learns does. A touch comes with every request for the state: first a press, then slides.
pub(super) fn learns(line: Line) -> impl FnMut(Request, &mut Sent) + Send + 'static {
    let (mut all, mut is_late) = (LearnedTextures::default(), false);
    if line == Line::Full {
        all.names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"].map(TextureName::new);
    }
    move |request, sent| match request {
        // A board tells its textures when a frame has ended, and its settings at once.
        Request::Settings => {
            sent.push(&Message::Settings(SettingsInUse::new(compiled_in(), false)));
            if std::mem::take(&mut is_late) {
                sent.push(&Message::Textures(all));
            }
        }
        Request::Textures if all.learning.is_none() => is_late = true,
        Request::Textures => {
            touch(&mut all, line, sent);
            sent.push(&Message::Textures(all));
        }
        Request::Learn(name) => {
            let has_room = all.names.contains(&None);
            let step = if has_room { LearningStep::Begun } else { LearningStep::Failed(NotLearned::Full) };
            let state = Learning::new(name, 0, 5, step);
            all.learning = Some(state).filter(|_| has_room);
            sent.push(&Message::Learning(state));
        }
        Request::ForgetTexture(name) => {
            all.names.iter_mut().for_each(|place| *place = place.filter(|other| *other != name));
            sent.push(&Message::Textures(all));
        }
        // It takes no models.
        Request::Model => {}
        Request::Forget => sent.push(&Message::Set(Ok(()))),
        other => panic!("{other:?}"),
    }
}

/// Takes the next touch if a texture is learned.
fn touch(all: &mut LearnedTextures, line: Line, sent: &mut Sent) {
    let Some(mut state) = all.learning else { return };
    if state.step == LearningStep::Begun {
        state.step = LearningStep::NotTaken(NotTaken::NoSlide);
    } else {
        (state.slides, state.step) = (state.slides + 1, LearningStep::Taken);
    }
    all.learning = Some(state);
    if state.slides == 5 {
        state.step = LearningStep::Learned;
        all.learning = None;
        *all.names.iter_mut().find(|place| place.is_none_or(|other| other == state.name)).unwrap() = Some(state.name);
    }
    match line {
        Line::Loses(slides) if slides == state.slides => {}
        Line::Restarts(slides) if slides == state.slides => all.learning = None,
        _ => sent.push(&Message::Learning(state)),
    }
}

#[test]
fn a_texture_is_learned_shown_and_forgotten() {
    let board = Board::that(learns(Line::Whole));
    assert_eq!(board.json(&[])["textures"], json!([]));
    let done = board.run(&["--learn", "carpet"]);
    let told = "wstac: slide carpet over the sensor 5 times, at any speed and in any direction\n\
                wstac: 0 of 5; not taken: the touch is no slide\n\
                wstac: 1 of 5\nwstac: 2 of 5\nwstac: 3 of 5\nwstac: 4 of 5\nwstac: 5 of 5; carpet is learned\n\
                wstac: settings that are compiled in\n";
    assert_eq!(said(&done), told);
    assert!(printed(&done).ends_with("# It has learned the texture carpet.\n"), "{}", printed(&done));
    assert_eq!(board.json(&[])["textures"], json!(["carpet"]));
    board.refuses(&["--unlearn", "wood"], "has learned no texture wood");
    assert_eq!(board.json(&["--unlearn", "carpet"])["textures"], json!([]));
    // With the settings, all textures are forgotten.
    printed(&board.run(&["--learn", "wood"]));
    assert_eq!(board.json(&["--forget"])["textures"], json!([]));
}

#[test]
fn a_message_that_is_lost_does_not_matter() {
    for lost in [3, 5] {
        let board = Board::that(learns(Line::Loses(lost)));
        let done = board.run(&["--learn", "carpet"]);
        says(&done, 0, &["3 of 5\n", "5 of 5; carpet is learned"]);
        assert!(printed(&done).contains("carpet"), "{lost}");
    }
}

#[test]
fn what_cannot_be_learned_is_refused_with_the_reason() {
    let board = Board::that(learns(Line::Restarts(2)));
    board.refuses(&["--learn", "carpet"], "has stopped learning: it has started again");
    let full = Board::that(learns(Line::Full));
    full.refuses(&["--learn", "k"], "does not learn the texture: it has 10 learned textures, expected fewer");
    let long = "x".repeat(24);
    for bad in ["", long.as_str(), "a\u{7}"] {
        let done = full.run(&["--learn", bad]);
        assert_eq!(done.status.code(), Some(2), "{bad:?}");
        assert!(!bad.starts_with('x') || said(&done).contains("expected a name of 1 to 23 bytes"), "{}", said(&done));
    }
}
