//! Learns textures with the embedding of 25 taxels, from samples that are made up: a pattern of each texture, and
//! noise.

use std::boxed::Box;
use std::vec::Vec;

use wstac_core::learned::Center;
use wstac_core::model::linear_svm::LinearSvm;
use wstac_core::model::place::Place;
use wstac_core::touch::motion::Contact;

use super::*;

static EMBEDDING: Kind = wstac_core::include_model!(LinearSvm, "../../../wstac-host/models/path/taxel-embedding.wsm");
/// A model that does not tell what is unknown.
static PLAIN: Kind = wstac_core::include_model!(LinearSvm, "../../../wstac-host/models/svm.wsm");

/// Returns a sample of a texture: the same pattern each time, with other noise.
fn sample(texture: u32, slide: u32) -> [i16; INPUTS] {
    let mut state = texture.wrapping_mul(2_654_435_761);
    let mut noise = slide.wrapping_mul(40_503).wrapping_add(texture);
    let next = |state: &mut u32, width: u32| {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((*state >> 16) % (2 * width + 1)) as i16 - width as i16
    };
    core::array::from_fn(|_| 500 + next(&mut state, 400) + next(&mut noise, 12))
}

fn names() -> &'static Names {
    Box::leak(Box::new(no_names()))
}

fn name(text: &str) -> TextureName {
    TextureName::new(text).unwrap()
}

/// Returns the answers of a reliable slide, as they come over the link: everything else is 0 or nothing.
fn slide() -> Answers<'static> {
    let (no_speed, no_direction) = ([1, 0], [1, 0, 0, 0]);
    let bytes = [&[0, 0, 0, 1, 0, 0][..], &no_speed, &no_direction, &[0, 0, 0, 0, 1, 0, 0]].concat();
    let mut answers: Answers<'static> = postcard::from_bytes(Box::leak(bytes.into_boxed_slice())).unwrap();
    answers.contact = Some(Contact::Slide);
    answers
}

/// A board whose flash is a list.
struct Fw {
    learner: Learner,
    kept: [Option<KeptTexture>; MOST_TEXTURES],
    model: &'static Kind,
    fails: bool,
}

impl Fw {
    fn new(model: &'static Kind, kept: [Option<KeptTexture>; MOST_TEXTURES]) -> Self {
        let mut learner = Learner::default();
        learner.load(names(), Some(model.checksum()), |place| kept[usize::from(place)]);
        Self { learner, kept, model, fails: false }
    }

    fn step(&mut self) -> Option<Message<'static>> {
        let Self { learner, kept, fails, .. } = self;
        learner.step(|place, texture| {
            if !*fails {
                kept[usize::from(place)] = texture.copied();
            }
            !*fails
        })
    }

    fn ask(&mut self, request: Request, now: u32) -> Option<Message<'static>> {
        self.learner.request(request, Some(self.model), now);
        self.step()
    }

    fn learning(&mut self) -> (u8, LearningStep) {
        match self.step() {
            Some(Message::Learning(state)) => (state.slides, state.step),
            other => panic!("{other:?}"),
        }
    }

    /// Gives an event with a sample, and returns its answer.
    fn touch(
        &mut self,
        answers: &Answers<'_>,
        sample: Option<[i16; INPUTS]>,
        now: u32,
    ) -> Option<TextureAnswer<'static>> {
        self.learner.look(answers, now);
        let answer = sample.map(|numbers| self.learner.answer(&numbers, self.model));
        self.learner.leave();
        answer
    }

    fn teach(&mut self, text: &str, texture: u32) {
        let begun = self.ask(Request::Learn(name(text)), 0);
        assert!(matches!(begun, Some(Message::Learning(state)) if state.step == LearningStep::Begun));
        for number in 1..=SLIDES as u32 {
            self.touch(&slide(), Some(sample(texture, number)), 0);
            let step = if number < 5 { LearningStep::Taken } else { LearningStep::Learned };
            assert_eq!(self.learning(), (number as u8, step));
        }
    }

    fn label(&mut self, texture: u32, number: u32) -> (std::string::String, Task, Option<bool>) {
        let answer = self.touch(&slide(), Some(sample(texture, number)), 0).unwrap();
        (std::format!("{}", answer.label), answer.task, answer.known)
    }
}

#[test]
fn a_texture_of_five_slides_is_named_also_after_a_reset() {
    let mut fw = Fw::new(&EMBEDDING, [None; MOST_TEXTURES]);
    let before = fw.label(1, 99);
    assert_eq!(before.1, Task::Specimen);
    fw.teach("carpet", 1);
    fw.teach("wood", 2);
    let known = |text: &str| (text.into(), Task::Other, Some(true));
    assert_eq!([fw.label(1, 99), fw.label(2, 99)], [known("carpet"), known("wood")]);
    // What was kept is what five slides teach a host.
    let places: Vec<Place> = (1..=5).map(|number| EMBEDDING.place(&sample(1, number)).unwrap()).collect();
    let kept = fw.kept[0].unwrap();
    assert_eq!((kept.center, kept.name, kept.model), (Center::of(&places), name("carpet"), EMBEDDING.checksum()));
    // A third texture is what the model says.
    let other = fw.label(3, 99);
    assert_eq!(other, Fw::new(&EMBEDDING, [None; MOST_TEXTURES]).label(3, 99));
    let mut again = Fw::new(&EMBEDDING, fw.kept);
    assert_eq!([again.label(1, 7), again.label(2, 7), again.label(3, 99)], [known("carpet"), known("wood"), other]);
    // Learned with another model, they mean nothing.
    let mut elsewhere = fw.kept;
    elsewhere.iter_mut().flatten().for_each(|texture| texture.model ^= 1);
    assert_eq!(Fw::new(&EMBEDDING, elsewhere).label(1, 99), before);
}

#[test]
fn touches_that_teach_nothing_are_refused_with_the_reason() {
    let mut fw = Fw::new(&EMBEDDING, [None; MOST_TEXTURES]);
    fw.ask(Request::Learn(name("carpet")), 0);
    let (mut press, mut doubtful, mut filled) = (slide(), slide(), slide());
    press.contact = Some(Contact::Press);
    doubtful.reliable = false;
    filled.frames_filled = 1;
    for (answers, sample, reason) in [
        (press, None, NotTaken::NoSlide),
        (doubtful, Some(sample(1, 1)), NotTaken::Unreliable),
        (filled, Some(sample(1, 1)), NotTaken::LostFrames),
        (slide(), None, NotTaken::TooShort),
    ] {
        fw.touch(&answers, sample, 0);
        assert_eq!(fw.learning(), (0, LearningStep::NotTaken(reason)));
    }
    fw.touch(&slide(), Some(sample(1, 1)), 0);
    assert_eq!(fw.learning(), (1, LearningStep::Taken));
    // A request that is repeated does not begin anew, and the state can be asked for.
    let again = fw.ask(Request::Learn(name("carpet")), 0);
    assert!(matches!(again, Some(Message::Learning(state)) if state.slides == 1), "{again:?}");
    let Some(Message::Textures(all)) = fw.ask(Request::Textures, 0) else { panic!("textures are not told") };
    assert_eq!((all.names, all.learning.unwrap().slides), ([None; MOST_TEXTURES], 1));
    // Another name does.
    let other = fw.ask(Request::Learn(name("wood")), 0);
    assert!(matches!(other, Some(Message::Learning(state)) if state.slides == 0), "{other:?}");
}

#[test]
fn learning_ends_if_it_is_stopped_or_nobody_watches() {
    let failed =
        |message| matches!(message, Some(Message::Learning(state)) if matches!(state.step, LearningStep::Failed(_)));
    let mut fw = Fw::new(&EMBEDDING, [None; MOST_TEXTURES]);
    fw.ask(Request::Learn(name("carpet")), 0);
    assert!(failed(fw.ask(Request::StopLearning, 0)));
    assert_eq!(fw.ask(Request::StopLearning, 0), None);
    let begin = u32::MAX - 5;
    fw.ask(Request::Learn(name("carpet")), begin);
    fw.ask(Request::Textures, begin.wrapping_add(1000));
    fw.touch(&slide(), Some(sample(1, 1)), begin.wrapping_add(1000 + LEARNING_MS));
    assert_eq!(fw.learning(), (1, LearningStep::Taken));
    fw.touch(&slide(), Some(sample(1, 2)), begin.wrapping_add(1001 + LEARNING_MS));
    assert_eq!(fw.learning(), (1, LearningStep::Failed(NotLearned::Stopped)));
    fw.touch(&slide(), Some(sample(1, 3)), 0);
    assert_eq!(fw.step(), None);
    // A lesson that was left alone is not gone on with.
    fw.ask(Request::Learn(name("carpet")), 0);
    fw.touch(&slide(), Some(sample(2, 1)), 10);
    assert_eq!(fw.learning(), (1, LearningStep::Taken));
    let again = fw.ask(Request::Learn(name("carpet")), LEARNING_MS + 1);
    assert!(
        matches!(again, Some(Message::Learning(Learning { slides: 0, step: LearningStep::Begun, .. }))),
        "{again:?}"
    );
}

#[test]
fn a_board_that_cannot_learn_says_why() {
    let why = |message| match message {
        Some(Message::Learning(Learning { step: LearningStep::Failed(why), .. })) => why,
        other => panic!("{other:?}"),
    };
    let mut plain = Fw::new(&PLAIN, [None; MOST_TEXTURES]);
    assert_eq!(why(plain.ask(Request::Learn(name("carpet")), 0)), NotLearned::NoModel);
    let mut none = Learner::default();
    none.load(names(), None, |_| None);
    none.request(Request::Learn(name("carpet")), None, 0);
    assert_eq!(why(none.step(|_, _| true)), NotLearned::NoModel);
    let mut fw = Fw::new(&EMBEDDING, [None; MOST_TEXTURES]);
    let all = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"];
    for (number, text) in (0..).zip(all) {
        fw.teach(text, number);
    }
    assert_eq!(why(fw.ask(Request::Learn(name("k")), 0)), NotLearned::Full);
    // One of the ten can be learned anew, and names survive.
    fw.teach("j", 30);
    assert_eq!((fw.label(30, 9).0, fw.label(0, 9).0), ("j".into(), "a".into()));
    // After one is forgotten and the new start, there is room.
    let Some(Message::Textures(left)) = fw.ask(Request::ForgetTexture(name("b")), 0) else { panic!("no answer") };
    assert_eq!((left.names[0], left.names[1], left.names[9]), (Some(name("a")), None, Some(name("j"))));
    assert_eq!(why(fw.ask(Request::Learn(name("k")), 0)), NotLearned::Full);
    let mut again = Fw::new(&EMBEDDING, fw.kept);
    again.teach("k", 40);
    assert_eq!(again.label(40, 9).0, "k");
    // A memory that fails.
    again.fails = true;
    again.ask(Request::Learn(name("k")), 0);
    for number in 1..=5 {
        again.touch(&slide(), Some(sample(41, number)), 0);
        if number < 5 {
            again.learning();
        }
    }
    // A request in between does not lose it.
    again.learner.request(Request::Textures, Some(&EMBEDDING), 0);
    assert_eq!(again.learning(), (5, LearningStep::Failed(NotLearned::Memory)));
    assert_eq!(again.label(40, 10).0, "k");
    let Some(Message::Textures(all)) = again.ask(Request::ForgetTexture(name("k")), 0) else { panic!("no answer") };
    assert_eq!(all.names[1], Some(name("k")));
}
