//! The switches of [`FitConfig`] one by one: key, label, answers and what each means. The *Fit* pane, the flags on the loss
//! curve and the documentation read this table, as sliders read [`super::FIELDS`].

use super::{
    Background, Convergence, FitConfig, FramesAround, GradientVelocity, Height, Limbs, Parameterization, Place,
    Scatterers, Still, Summation, WarmStart, Yaw,
};

/// Where a switch is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChoiceGroup {
    /// With the optimiser.
    Optimiser,
    /// With the radar's simulation.
    Radar,
    /// With what is moved and what a start looks like.
    Model,
    /// With how a start is found.
    Start,
}

impl ChoiceGroup {
    /// The switches of this group, in the order they are shown.
    pub fn choices(self) -> impl Iterator<Item = &'static Choice> {
        CHOICES.iter().filter(move |choice| choice.group == self)
    }
}

/// One answer to a switch.
pub struct Answer {
    /// As in `FIT.toml`.
    pub word: &'static str,
    /// On screen.
    pub label: &'static str,
    /// What it means, and why one would take it.
    pub help: &'static str,
}

/// A setting with a few answers.
pub struct Choice {
    /// The key in `FIT.toml`; `table.key` inside a table.
    pub key: &'static str,
    /// Where it is shown.
    pub group: ChoiceGroup,
    /// The label on screen.
    pub label: &'static str,
    /// The answers, the default first.
    pub answers: &'static [Answer],
    /// Which answer is given.
    pub get: fn(&FitConfig) -> usize,
    /// Gives an answer; what is no answer changes nothing.
    pub set: fn(&mut FitConfig, usize),
}

impl Choice {
    /// Whether it is read when a start is found, and no later.
    pub fn starts(&self) -> bool {
        match self.group {
            ChoiceGroup::Optimiser | ChoiceGroup::Radar => false,
            ChoiceGroup::Model => self.key != "parameterization",
            ChoiceGroup::Start => true,
        }
    }

    /// The answer that a configuration gives.
    pub fn answer(&self, config: &FitConfig) -> Option<&'static Answer> {
        self.answers.get((self.get)(config))
    }
}

/// Position of a value among the answers of its switch, and back.
macro_rules! among {
    ($($field:ident).+, [$($value:expr),+ $(,)?]) => {
        (
            |c: &FitConfig| [$($value),+].iter().position(|value| *value == c.$($field).+).unwrap_or(0),
            |c: &mut FitConfig, k: usize| {
                if let Some(value) = [$($value),+].get(k) {
                    c.$($field).+ = *value;
                }
            },
        )
    };
}

type Access = (fn(&FitConfig) -> usize, fn(&mut FitConfig, usize));

const fn choice(
    key: &'static str,
    group: ChoiceGroup,
    label: &'static str,
    answers: &'static [Answer],
    (get, set): Access,
) -> Choice {
    Choice { key, group, label, answers, get, set }
}

const fn answer(word: &'static str, label: &'static str, help: &'static str) -> Answer {
    Answer { word, label, help }
}

/// Every switch with named answers, in the order it is shown.
pub const CHOICES: &[Choice] = &[
    choice(
        "convergence",
        ChoiceGroup::Optimiser,
        "Converged",
        &[
            answer(
                "change",
                "little change",
                "L < 1, or |L₋₅ − L| < 0.5 % of L₋₅: a loss that still rises has not converged (SPEC 4).",
            ),
            answer(
                "improvement",
                "little improvement",
                "L < 1, or L₋₅ − L < 0.5 % of L₋₅: the paper's words (5.5.4). A loss that rises counts as converged.",
            ),
        ],
        among!(convergence, [Convergence::Change, Convergence::Improvement]),
    ),
    choice(
        "summation",
        ChoiceGroup::Radar,
        "Sum",
        &[
            answer("coherent", "coherent", "H_sim = |Σ A K e^{iψ}|: joints interfere. The paper."),
            answer("incoherent", "incoherent", "H_sim = √Σ (A K)²: powers add."),
        ],
        among!(summation, [Summation::Coherent, Summation::Incoherent]),
    ),
    choice(
        "parameterization",
        ChoiceGroup::Model,
        "Moves",
        &[
            answer("joints", "joints", "Every joint by itself: the paper."),
            answer(
                "bones",
                "root and bones",
                "The root moves and turns, bones turn about their inner joint: lengths stay.",
            ),
        ],
        among!(parameterization, [Parameterization::Joints, Parameterization::Bones]),
    ),
    choice(
        "scatterers",
        ChoiceGroup::Model,
        "Gaussians",
        &[
            answer("equal", "equal", "Round, all alike: the paper says nothing else."),
            answer("body_parts", "by body part", "Along the bones, as wide and bright as the part."),
        ],
        among!(scatterers, [Scatterers::Equal, Scatterers::BodyParts]),
    ),
    choice(
        "yaw",
        ChoiceGroup::Model,
        "Looks",
        &[
            answer("radar", "at the radar", "The paper says nothing else."),
            answer("motion", "where it goes", "From its places in the frames around."),
        ],
        among!(yaw, [Yaw::Radar, Yaw::Motion]),
    ),
    choice(
        "place",
        ChoiceGroup::Model,
        "Place",
        &[
            answer(
                "peaks",
                "peaks",
                "Where a standing body put at the clusters of peaks is lit best in all views of this frame, moved to the middle of what is lit there: the middle of a cluster lies on whatever shines, not in a body.",
            ),
            answer("cluster", "cluster", "The middle of the strongest cluster of peaks, as it is: the paper (4.1.2)."),
            answer(
                "counted",
                "frames around",
                "One person stands where counting over the frames around finds it, if the peaks alone show somebody elsewhere.",
            ),
        ],
        among!(place, [Place::Peaks, Place::Cluster, Place::Counted]),
    ),
    choice(
        "height",
        ChoiceGroup::Model,
        "Height",
        &[
            answer("echo", "echo", "The middle of the echo."),
            answer("floor", "floor and head", "Where the data set tells the radar's height (height_m)."),
        ],
        among!(height, [Height::Echo, Height::Floor]),
    ),
    choice(
        "limbs",
        ChoiceGroup::Model,
        "Limbs",
        &[
            answer("posture", "of the posture", "The paper says nothing else."),
            answer("learned", "learned", "Moved as what is lit around the person says; learned from simulated people."),
        ],
        among!(limbs, [Limbs::Posture, Limbs::Learned]),
    ),
    choice(
        "frames_around",
        ChoiceGroup::Start,
        "Frames",
        &[
            answer(
                "both",
                "before and after",
                "What stands still, the count and where somebody goes are read from up to four frames on each side: a recording is there as a whole, and frames after tell as much as those before.",
            ),
            answer(
                "past",
                "before",
                "From the frames before alone: what a radar that runs can know. The paper counts over consecutive frames (appendix B) and starts from a frame alone (4.1).",
            ),
            answer("none", "none", "From the frame alone; people too are counted in it alone."),
        ],
        among!(frames_around, [FramesAround::Both, FramesAround::Past, FramesAround::None]),
    ),
    choice(
        "init.still",
        ChoiceGroup::Start,
        "Still echoes",
        &[
            answer(
                "left_out",
                "left out",
                "What does not change over the frames around is furniture: it is no evidence of a person. A wall often outshines people.",
            ),
            answer("kept", "kept", "They count as all others do: the paper, whose peaks are those of H."),
        ],
        among!(init.still, [Still::LeftOut, Still::Kept]),
    ),
    choice(
        "init.background",
        ChoiceGroup::Start,
        "Background",
        &[
            answer(
                "range",
                "at its range",
                "A cell counts by how far it rises over the median at its range: sidelobes and walls are arcs about the radar.",
            ),
            answer(
                "map",
                "of the map",
                "A cell counts by H itself: the paper, whose peaks are those above a percentile of H (4.1.1).",
            ),
        ],
        among!(init.background, [Background::Range, Background::Map]),
    ),
    choice(
        "init.gradient",
        ChoiceGroup::Start,
        "Gradient",
        &[
            answer(
                "flow",
                "with a sign",
                "v_r = ±γ·g without a Doppler axis, the sign that of the change to the nearest frame; 0 where there is none: a magnitude does not say whether somebody comes or goes.",
            ),
            answer(
                "magnitude",
                "magnitude",
                "v_r = γ·g of the frame alone, always away from the radar: appendix A as printed.",
            ),
        ],
        among!(init.gradient, [GradientVelocity::Flow, GradientVelocity::Magnitude]),
    ),
    choice(
        "warm_start",
        ChoiceGroup::Start,
        "Warm start",
        &[
            answer(
                "moved",
                "moved",
                "At the result of the frame before, moved as the echo moved since: 25 steps of a millimetre do not follow who walks.",
            ),
            answer("as_left", "as left", "At the result of the frame before as it is: the paper (5.5.4)."),
        ],
        among!(warm_start, [WarmStart::Moved, WarmStart::AsLeft]),
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_answer_is_a_word_of_fit_toml_and_the_first_is_the_default() {
        for choice in CHOICES {
            assert_eq!((choice.get)(&FitConfig::default()), 0, "{}", choice.key);
            for (k, answer) in choice.answers.iter().enumerate() {
                let text = match choice.key.split_once('.') {
                    Some((table, key)) => format!("[{table}]\n{key} = \"{}\"\n", answer.word),
                    None => format!("{} = \"{}\"\n", choice.key, answer.word),
                };
                let read = FitConfig::parse(&text, Path::new("fit.toml"));
                assert!(read.is_ok(), "{text}: {:?}", read.err());
                let mut set = FitConfig::default();
                (choice.set)(&mut set, k);
                assert_eq!(read.ok(), Some(set), "{text}");
                assert_eq!((choice.get)(&set), k, "{text}");
                assert_eq!(choice.answer(&set).map(|given| given.word), Some(answer.word));
            }
            let mut same = FitConfig::default();
            (choice.set)(&mut same, choice.answers.len());
            assert_eq!(same, FitConfig::default(), "{}: no such answer", choice.key);
        }
    }

    /// Every word in a serialised configuration is an answer of some switch: none is forgotten.
    #[test]
    fn every_switch_of_a_configuration_is_in_the_table() {
        let table: toml::Table = toml::from_str(&FitConfig::default().to_toml()).unwrap_or_default();
        let words = |table: &toml::Table, before: &str| -> Vec<String> {
            let named = table.iter().filter(|(_, value)| value.is_str());
            named.map(|(key, _)| format!("{before}{key}")).collect()
        };
        let mut keys = words(&table, "");
        for (name, inner) in table.iter().filter_map(|(name, value)| Some((name, value.as_table()?))) {
            keys.extend(words(inner, &format!("{name}.")));
        }
        assert!(keys.len() >= 13, "{keys:?}");
        for key in keys {
            assert!(CHOICES.iter().any(|choice| choice.key == key), "{key}");
        }
    }
}
