//! Learns textures from slides while a host watches, and names them afterwards, beside those of the model.
//!
//! A host asks for a texture of a name ([`Request::Learn`]). The next slides give its center, which is kept. Each touch
//! in between is reported, with the reason if it was not taken. The arithmetic is that of [`wstac_core::learned`].

use core::cell::OnceCell;

use wstac_core::learned::{Center, Lesson, SLIDES, nearest};
use wstac_core::model::file::{INPUTS, Task};
use wstac_core::texture;
use wstac_core::wire::{
    Answers, LEARNING_MS, LearnedTextures, Learning, LearningStep, MOST_TEXTURES, Message, NotLearned, NotTaken,
    Request, Text, TextureAnswer, TextureName,
};

use crate::settings::KeptTexture;
use crate::setup::Kind;

/// The names of learned textures. Each is written once, so that events can have it until the next start.
pub type Names = [OnceCell<TextureName>; MOST_TEXTURES];
/// Returns the names before any texture is learned.
pub const fn no_names() -> Names {
    [const { OnceCell::new() }; MOST_TEXTURES]
}

/// The learned textures, and the one that is being learned.
#[derive(Clone, Debug, Default)]
pub struct Learner {
    /// `None` before they were loaded.
    names: Option<&'static Names>,
    /// The checksum of the model whose projection is used.
    model: u32,
    centers: [Option<Center>; MOST_TEXTURES],
    course: Option<Course>,
    /// The work and the answers that wait.
    task: Option<TextureTask>,
}

/// The learning of a texture.
#[derive(Clone, Copy, Debug)]
struct Course {
    name: TextureName,
    /// The place of the texture among all.
    place: u8,
    lesson: Lesson,
    /// The time at which a host asked last.
    heard_at: u32,
    step: LearningStep,
    /// Whether the sample of the event that is looked at is to be taken.
    takes_sample: bool,
}

impl Course {
    fn state(&self) -> Learning {
        Learning::new(self.name, self.lesson.slides() as u8, SLIDES as u8, self.step)
    }
}

/// Something that is to be done between frames.
#[derive(Clone, Copy, Debug)]
enum TextureTask {
    Tell(Learning),
    /// All textures have to be told.
    TellAll,
    /// The center was learned, and has to be kept.
    Keep(Center),
    /// The texture at this place is to be forgotten.
    Forget(u8),
}

impl Learner {
    /// Takes the textures that were kept, as far as they were learned with the model of this checksum. Without a model,
    /// nothing can be learned.
    pub fn load(&mut self, names: &'static Names, model: Option<u32>, mut kept: impl FnMut(u8) -> Option<KeptTexture>) {
        (self.names, self.model) = (model.map(|_| names), model.unwrap_or(0));
        for (place, (name, center)) in (0..).zip(names.iter().zip(&mut self.centers)) {
            if let Some(texture) = kept(place).filter(|texture| Some(texture.model) == model)
                && name.set(texture.name).is_ok()
            {
                *center = Some(texture.center);
            }
        }
    }

    /// Takes a request about textures.
    pub fn request(&mut self, request: Request, model: Option<&Kind>, now: u32) {
        // Nobody has asked for long: what was learned until then is not gone on with.
        self.course = self.course.filter(|course| now.wrapping_sub(course.heard_at) <= LEARNING_MS);
        if let Some(course) = &mut self.course {
            course.heard_at = now;
        }
        // A learned texture is kept first. A host asks again.
        if matches!(self.task, Some(TextureTask::Keep(_))) {
            return;
        }
        match request {
            Request::Learn(name) => {
                let begun = self.begin(name, model, now);
                self.task = Some(TextureTask::Tell(begun));
            }
            Request::StopLearning => self.fail(NotLearned::Stopped),
            Request::ForgetTexture(name) => {
                self.task = Some(self.place_of(&name).map_or(TextureTask::TellAll, TextureTask::Forget));
            }
            // A message that already waits goes first.
            _ => self.task = self.task.or(Some(TextureTask::TellAll)),
        }
    }

    /// Begins to learn, or goes on, and returns the state.
    fn begin(&mut self, name: TextureName, model: Option<&Kind>, now: u32) -> Learning {
        if let Some(course) = self.course.filter(|course| course.name == name) {
            return course.state();
        }
        self.course = None;
        let refused = |why| Learning::new(name, 0, SLIDES as u8, LearningStep::Failed(why));
        if self.names.is_none() || !model.is_some_and(Kind::tells_unknown) {
            return refused(NotLearned::NoModel);
        }
        let free = || self.names?.iter().position(|name| name.get().is_none()).map(|place| place as u8);
        let Some(place) = self.place_of(&name).or_else(free) else { return refused(NotLearned::Full) };
        let step = LearningStep::Begun;
        let course = Course { name, place, lesson: Lesson::new(), heard_at: now, step, takes_sample: false };
        self.course.insert(course).state()
    }

    /// Ends learning for this reason, which is told.
    fn fail(&mut self, why: NotLearned) {
        if let Some(course) = self.course.take() {
            let state = Course { step: LearningStep::Failed(why), ..course }.state();
            self.task = Some(TextureTask::Tell(state));
        }
    }

    fn place_of(&self, name: &TextureName) -> Option<u8> {
        let has_name = |place: &OnceCell<TextureName>| place.get() == Some(name);
        self.names?.iter().position(has_name).map(|place| place as u8)
    }

    /// Returns whether textures are being learned, which takes whole samples.
    pub fn are_learned(&self) -> bool {
        self.course.is_some()
    }

    /// Looks at an event before its sample: whether it can be learned from.
    pub fn look(&mut self, answers: &Answers<'_>, now: u32) {
        let Some(course) = &mut self.course else { return };
        if now.wrapping_sub(course.heard_at) > LEARNING_MS {
            self.fail(NotLearned::Stopped);
            return;
        }
        let reason = if !answers.has_texture() {
            Some(NotTaken::NoSlide)
        } else if answers.frames_filled > 0 {
            Some(NotTaken::LostFrames)
        } else if !answers.reliable {
            Some(NotTaken::Unreliable)
        } else {
            None
        };
        course.takes_sample = reason.is_none();
        // This step stays if no sample comes.
        course.step = LearningStep::NotTaken(reason.unwrap_or(NotTaken::TooShort));
    }

    /// Returns the answer about a sample, and learns from it.
    pub fn answer(&mut self, numbers: &[i16; INPUTS], model: &'static Kind) -> TextureAnswer<'static> {
        let found = texture::texture(numbers, model);
        self.name_of(numbers, model, found.class).unwrap_or_else(|| found.into())
    }

    /// Returns the answer of a learned texture in place of the model's class, and learns from the sample.
    // It is not inlined, so that its places do not lie on the stack of the model.
    #[inline(never)]
    fn name_of(&mut self, numbers: &[i16; INPUTS], model: &'static Kind, class: u8) -> Option<TextureAnswer<'static>> {
        let place = model.place(numbers)?;
        if let Some(course) = &mut self.course
            && course.takes_sample
        {
            course.takes_sample = false;
            course.step = LearningStep::Taken;
            if let Some(center) = course.lesson.push(place) {
                self.task = Some(TextureTask::Keep(center));
            }
        }
        let rival = model.mean_place(class).map(|mean| mean.squared_distance(&place));
        let names = self.names.into_iter().flatten();
        let learned = names.zip(&self.centers).filter_map(|(name, center)| Some((name.get()?, center.as_ref()?)));
        let name = nearest(&place, rival, learned)?;
        let mut answer = TextureAnswer::new(Task::Other, Text::new(name.as_str()));
        answer.known = Some(true);
        Some(answer)
    }

    /// Leaves the event. What it taught is told.
    pub fn leave(&mut self) {
        if let Some(course) = &mut self.course {
            course.takes_sample = false;
            if !matches!(self.task, Some(TextureTask::Keep(_))) {
                self.task = Some(TextureTask::Tell(course.state()));
            }
        }
    }

    /// Does what is to be done between frames, and returns the message about it. `keep` keeps a texture at a place, or
    /// forgets it, and returns whether that was done.
    pub fn step(&mut self, keep: impl FnOnce(u8, Option<&KeptTexture>) -> bool) -> Option<Message<'static>> {
        match self.task.take()? {
            TextureTask::Tell(state) => Some(Message::Learning(state)),
            TextureTask::TellAll => Some(Message::Textures(self.all())),
            TextureTask::Keep(center) => {
                let mut course = self.course.take()?;
                let texture = KeptTexture { model: self.model, name: course.name, center };
                let is_kept = keep(course.place, Some(&texture)) && self.use_center(course.place, &texture);
                course.step = if is_kept { LearningStep::Learned } else { LearningStep::Failed(NotLearned::Memory) };
                Some(Message::Learning(course.state()))
            }
            TextureTask::Forget(place) => {
                if keep(place, None)
                    && let Some(center) = self.centers.get_mut(usize::from(place))
                {
                    *center = None;
                }
                Some(Message::Textures(self.all()))
            }
        }
    }

    /// Uses a texture from now on. Returns whether it has its place.
    fn use_center(&mut self, place: u8, texture: &KeptTexture) -> bool {
        let place = usize::from(place);
        let (Some(center), Some(name)) = (self.centers.get_mut(place), self.names.and_then(|names| names.get(place)))
        else {
            return false;
        };
        *center = Some(texture.center);
        *name.get_or_init(|| texture.name) == texture.name
    }

    fn all(&self) -> LearnedTextures {
        let mut all = LearnedTextures::default();
        for ((place, name), center) in all.names.iter_mut().zip(self.names.into_iter().flatten()).zip(&self.centers) {
            *place = center.and(name.get().copied());
        }
        all.learning = self.course.map(|course| course.state());
        all
    }
}

#[cfg(test)]
mod tests;
