//! The text that filters the frame list: `stratum:hard iou<0.5 -tag:F1`.
//!
//! Terms are separated by spaces and must all hold; a `-` before a term negates it; `a|b` after a colon means either.
//! A bare word is looked for in the frame's name. What a frame has no value for satisfies no comparison.

use super::row::{FrameNumber, FrameRow, Reads};
use crate::condition::{Comparison, comparison, split};
use crate::dataset::OriginPart;
use crate::labels::{Tag, Verdict};
use crate::mhp::TERMS;
use crate::session::sources::SourceNumber;
use crate::study::complexity::Stratum;

/// A parsed filter. The empty text matches every frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameFilter {
    terms: Vec<Term>,
}

#[derive(Debug, Clone, PartialEq)]
struct Term {
    negated: bool,
    test: Test,
}

#[derive(Debug, Clone, PartialEq)]
enum Test {
    /// The name contains this, in lower case.
    Name(String),
    /// One of the values of a word.
    Word(Word, Vec<String>),
    /// A tag, `None` for any or for none at all.
    Tags { any_of: Vec<Tag>, any: bool, none: bool },
    /// A number compared with a limit.
    Compare(FrameNumber, Comparison, f64),
    /// A number of a source of predictions, by its name, compared with a limit.
    Source(String, SourceNumber, Comparison, f64),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Stratum,
    Sequence,
    Scene,
    Origin(OriginPart),
    Note,
    By,
    Verdict,
    Reason,
    Converged,
    Fitted,
    Readable,
    Mismatch,
}

const WORDS: [(&str, Word); 14] = [
    ("stratum", Word::Stratum),
    ("sequence", Word::Sequence),
    ("scene", Word::Scene),
    ("subject", Word::Origin(OriginPart::Subject)),
    ("session", Word::Origin(OriginPart::Session)),
    ("action", Word::Origin(OriginPart::Action)),
    ("note", Word::Note),
    ("by", Word::By),
    ("verdict", Word::Verdict),
    ("reason", Word::Reason),
    ("converged", Word::Converged),
    ("fitted", Word::Fitted),
    ("readable", Word::Readable),
    ("mismatch", Word::Mismatch),
];

/// What a filter may say, for the tooltip of its field.
pub fn syntax() -> String {
    let of_loss: Vec<&str> = TERMS.iter().map(|term| term.key).collect();
    format!(
        "Terms that must all hold, separated by spaces; - negates, | means either:\n\
        stratum:hard · tag:F1 · tag:F1|F2 · tag:none · tag:any · by:ada · note:word\n\
        scene:lab · subject:07 · session:2 · action:walk, as far as the data set tells them · sequence:d5s1\n\
        iou<0.5 · majpe>200 · basin<0.9 · hardness>=0.7 · peaks static saliency loss iterations index\n\
        a b diff: the two result sets that are compared, and B − A\n\
        pred.NAME>100: MAJPE of a source of predictions, mm · pred.NAME.pa · pred.NAME.fit: how far it is from the fit\n\
        disagree>100: the source that is farthest from the fit, mm\n\
        {}: the terms of the loss\n\
        converged:no · fitted:yes · reason:diverged · verdict:detection-error · readable:no\n\
        mismatch:yes: another number of people counted (fits with people = 0) than annotated\n\
        A bare word is looked for in the frame's name.",
        of_loss.join(" ")
    )
}

impl FrameFilter {
    /// Parses a filter.
    ///
    /// # Errors
    /// One line that names the term and what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        Ok(Self { terms: split(text)?.iter().map(|part| term(part)).collect::<Result<_, _>>()? })
    }

    /// True where every frame matches.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// What of a row the answer depends on.
    pub fn reads(&self) -> Reads {
        self.terms.iter().fold(Reads::default(), |reads, term| reads.or(term.test.reads()))
    }

    /// True where a frame with this row matches.
    pub fn matches(&self, row: &FrameRow<'_>) -> bool {
        self.terms.iter().all(|term| term.test.holds(row) != term.negated)
    }
}

impl Test {
    fn reads(&self) -> Reads {
        let none = Reads::default();
        match self {
            Self::Name(_) => Reads { name: true, ..none },
            Self::Tags { .. } => Reads { tags: true, ..none },
            Self::Compare(number, ..) => number.reads(),
            Self::Source(_, number, ..) => number.reads(),
            Self::Word(word, _) => match word {
                Word::Stratum | Word::Readable => Reads { strata: true, ..none },
                Word::Sequence => Reads { sequence: true, ..none },
                Word::Scene => Reads { sequence: true, origin: true, ..none },
                Word::Origin(_) => Reads { origin: true, ..none },
                Word::Note | Word::Verdict => Reads { said: true, ..none },
                Word::By => Reads { annotators: true, ..none },
                Word::Reason | Word::Converged | Word::Fitted | Word::Mismatch => Reads { fit: true, ..none },
            },
        }
    }

    fn holds(&self, row: &FrameRow<'_>) -> bool {
        match self {
            Self::Name(part) => contains(row.name, part),
            Self::Tags { any_of, any, none } => {
                any_of.iter().any(|&tag| row.tags.contains(tag))
                    || (*any && !row.tags.is_empty())
                    || (*none && row.tags.is_empty())
            }
            Self::Compare(number, comparison, limit) => {
                row.number(*number).is_some_and(|value| comparison.holds(value, *limit))
            }
            Self::Source(name, number, comparison, limit) => {
                row.of_source(name, *number).is_some_and(|value| comparison.holds(value, *limit))
            }
            Self::Word(word, values) => values.iter().any(|value| word.holds(row, value)),
        }
    }
}

impl Word {
    fn holds(self, row: &FrameRow<'_>, value: &str) -> bool {
        let is = |text: Option<&str>| text.is_some_and(|text| text.eq_ignore_ascii_case(value));
        let yes = matches!(value, "yes" | "true" | "1");
        let is_of = |part| row.origin.part(part).map(|known| known.to_lowercase() == value);
        match self {
            Self::Stratum => is(row.stratum.map(Stratum::word)),
            Self::Sequence => contains(row.sequence, value),
            // What no scene is told of may have it in the name of the sequence.
            Self::Scene => is_of(OriginPart::Scene).unwrap_or_else(|| contains(row.sequence, value)),
            Self::Origin(part) => is_of(part) == Some(true),
            Self::Note => contains(row.note, value),
            Self::By => row.annotators.iter().any(|name| contains(name, value)),
            Self::Verdict => is(row.verdict.map(Verdict::code)),
            Self::Reason => row.reason.is_some_and(|reason| contains(reason, value)),
            Self::Converged => row.converged == Some(yes),
            Self::Fitted => row.iterations.is_some() == yes,
            Self::Readable => row.readable == yes,
            Self::Mismatch => row.mismatch == Some(yes),
        }
    }
}

/// True where `text` contains `part`, which is in lower case, whatever the case of `text`.
fn contains(text: &str, part: &str) -> bool {
    if part.is_ascii() {
        let (text, part) = (text.as_bytes(), part.as_bytes());
        return part.is_empty() || text.windows(part.len()).any(|window| window.eq_ignore_ascii_case(part));
    }
    text.to_lowercase().contains(part)
}

fn term(part: &str) -> Result<Term, String> {
    let (negated, rest) = part.strip_prefix('-').map_or((false, part), |rest| (true, rest));
    if rest.is_empty() {
        return Err("a single - negates nothing; expected for example -tag:F1".into());
    }
    Ok(Term { negated, test: test(rest)? })
}

fn test(text: &str) -> Result<Test, String> {
    if let Some(parts) = comparison(text) {
        // Which number is meant is told before what is wrong with its limit.
        let (key, comparison, limit) = match parts {
            Ok(parts) => parts,
            Err(why) if text.to_lowercase().starts_with(SOURCE) => return Err(why),
            Err(why) => {
                number(text.split(['<', '>', '=']).next().unwrap_or_default())?;
                return Err(why);
            }
        };
        if let Some(source) = key.to_lowercase().strip_prefix(SOURCE) {
            let (name, number) = source_number(source)?;
            return Ok(Test::Source(name, number, comparison, limit));
        }
        return Ok(Test::Compare(number(key)?, comparison, limit));
    }
    let Some((key, value)) = text.split_once(':') else { return Ok(Test::Name(text.to_lowercase())) };
    let key = key.to_lowercase();
    if FrameNumber::of(&key).is_some() {
        return Err(format!("`{text}`: {key} is a number; expected for example {key}<0.5"));
    }
    let values: Vec<String> = value.split('|').map(str::to_lowercase).filter(|v| !v.is_empty()).collect();
    if values.is_empty() {
        return Err(format!("`{text}`: nothing after the colon"));
    }
    if key == "tag" {
        return tags(&values);
    }
    let known = WORDS.iter().find(|(name, _)| *name == key).map(|(_, word)| *word);
    let word = known.ok_or_else(|| {
        let names: Vec<&str> = WORDS.iter().map(|(name, _)| *name).collect();
        format!("`{key}:` is not known; expected tag, {}", names.join(", "))
    })?;
    check(word, &values)?;
    Ok(Test::Word(word, values))
}

/// Words with a fixed set of values take no other.
fn check(word: Word, values: &[String]) -> Result<(), String> {
    let allowed: &[&str] = match word {
        Word::Stratum => &["easy", "medium", "hard"],
        Word::Verdict => &["annotation-error", "detection-error", "both-incorrect", "true-negative"],
        Word::Converged | Word::Fitted | Word::Readable | Word::Mismatch => &["yes", "no", "true", "false", "1", "0"],
        Word::Sequence | Word::Scene | Word::Origin(_) | Word::Note | Word::By | Word::Reason => return Ok(()),
    };
    match values.iter().find(|value| !allowed.contains(&value.as_str())) {
        Some(wrong) => Err(format!("`{wrong}`: expected {}", allowed.join(", "))),
        None => Ok(()),
    }
}

fn tags(values: &[String]) -> Result<Test, String> {
    let (mut any_of, mut any, mut none) = (Vec::new(), false, false);
    for value in values {
        match value.as_str() {
            "any" => any = true,
            "none" => none = true,
            code => any_of.push(code.parse().map_err(|why: String| format!("{why}, any or none"))?),
        }
    }
    Ok(Test::Tags { any_of, any, none })
}

/// What begins a number of a source of predictions.
const SOURCE: &str = "pred.";

/// `retr`, `retr.pa`, `retr.fit`.
fn source_number(text: &str) -> Result<(String, SourceNumber), String> {
    let (name, number) = match text.rsplit_once('.') {
        None => (text, SourceNumber::Error),
        Some((name, "mm" | "majpe")) => (name, SourceNumber::Error),
        Some((name, "pa")) => (name, SourceNumber::AlignedError),
        Some((name, "fit")) => (name, SourceNumber::ToFit),
        Some((_, other)) => {
            return Err(format!("`pred.{text}`: `{other}`; expected pred.NAME, pred.NAME.pa or pred.NAME.fit"));
        }
    };
    if name.is_empty() {
        return Err("`pred.`: no name; expected for example pred.retr>100".into());
    }
    Ok((name.to_owned(), number))
}

fn number(key: &str) -> Result<FrameNumber, String> {
    FrameNumber::of(&key.to_lowercase()).ok_or_else(|| {
        let names: Vec<&str> = FrameNumber::all().map(FrameNumber::key).collect();
        format!("`{key}` is no number of a frame; expected {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::dataset::Origin;
    use crate::labels::{Tags, Verdict};
    #[cfg(feature = "dummies")]
    use crate::mhp::Terms;
    use crate::session::sources::SourceNumbers;
    use crate::study::complexity::Stratum;

    fn row() -> FrameRow<'static> {
        FrameRow {
            index: 12,
            name: "d5s1/003/00012",
            sequence: "d5s1/003",
            readable: true,
            stratum: Some(Stratum::Hard),
            hardness: Some(0.9),
            iou: Some(0.42),
            iterations: Some(40),
            converged: Some(false),
            reason: Some("iterations"),
            tags: Tags::NONE.with(Tag::F2),
            note: "Two words, near the Wall",
            verdict: Some(Verdict::BothIncorrect),
            annotators: vec!["ada"],
            ..FrameRow::default()
        }
    }

    #[test]
    fn frames_whose_count_is_another_are_a_queue() {
        let with = |mismatch| FrameRow { mismatch, ..row() };
        let filter = FrameFilter::parse("mismatch:yes").unwrap();
        assert!(filter.matches(&with(Some(true))) && filter.reads().fit);
        assert!(!filter.matches(&with(Some(false))) && !filter.matches(&with(None)));
        assert!(FrameFilter::parse("mismatch:no").unwrap().matches(&with(Some(false))));
    }

    fn holds(text: &str) -> bool {
        FrameFilter::parse(text).unwrap().matches(&row())
    }

    #[test]
    fn every_term_must_hold() {
        assert!(holds(""));
        assert!(holds("stratum:hard iou<0.5 -tag:F1"));
        assert!(!holds("stratum:hard iou<0.4"));
        assert!(holds("STRATUM:Hard|easy tag:f1|F2 hardness>=0.9 index=12"));
        assert!(holds("d5S1 00012 -d6"));
        assert!(holds("note:\"near the wall\" by:AD verdict:both-incorrect scene:/003"));
        assert!(holds("converged:no fitted:yes tag:any -tag:none reason:iter"));
        assert!(!holds("converged:yes") && !holds("readable:no"));
    }

    #[test]
    fn an_unknown_value_satisfies_no_comparison() {
        assert!(!holds("majpe>0") && !holds("majpe<=0"));
        assert!(holds("-majpe>0"));
        let bare = FrameRow { name: "x", ..FrameRow::default() };
        assert!(!FrameFilter::parse("converged:no").unwrap().matches(&bare), "not fitted is not unconverged");
    }

    #[test]
    fn frames_are_of_the_scene_that_is_told_and_of_no_other() {
        let origin = Origin { scene: Some("Lab".into()), subject: Some("07".into()), ..Origin::default() };
        let row = FrameRow { origin, ..row() };
        let holds = |text: &str| FrameFilter::parse(text).unwrap().matches(&row);
        assert!(holds("scene:lab subject:07 sequence:d5s1 -subject:08 -action:walk"));
        assert!(!holds("scene:la") && !holds("scene:d5s1") && !holds("subject:7"), "words in full");
        assert!(!holds("sequence:lab") && !holds("session:d5s1"));
        assert!(FrameFilter::parse("action:walk").unwrap().reads().origin);
    }

    #[test]
    fn sources_are_asked_by_their_names() {
        let numbers = SourceNumbers { majpe_mm: Some(120.0), pa_majpe_mm: Some(60.0), to_fit_mm: None };
        let other = SourceNumbers { to_fit_mm: Some(90.0), ..SourceNumbers::default() };
        let row = FrameRow { sources: vec![("retr", numbers), ("mmdiff", other)], ..row() };
        let holds = |text: &str| FrameFilter::parse(text).unwrap().matches(&row);
        assert!(holds("pred.retr>100 pred.RETR.pa<70 pred.mmdiff.fit>80 disagree>80"));
        assert!(!holds("pred.retr.fit>0") && !holds("pred.none>0") && !holds("disagree>95"));
        assert!(FrameFilter::parse("pred.retr>1").unwrap().reads().sources);
        assert!(!FrameFilter::parse("pred.retr>1").unwrap().reads().to_fits);
    }

    #[test]
    fn what_is_wrong_is_told() {
        for (text, expected) in [
            ("iou:0.5", "iou is a number"),
            ("iou<a", "`a` is not a number"),
            ("stratum:hrad", "expected easy, medium, hard"),
            ("tag:F7", "expected F1"),
            ("foo:1", "`foo:` is not known"),
            ("foo<1", "expected index"),
            ("tag:", "nothing after the colon"),
            ("pred.>1", "no name"),
            ("pred.retr.x>1", "`x`; expected pred.NAME"),
            ("pred.retr>x", "not a number"),
            ("note:\"a", "quote"),
            ("-", "negates nothing"),
        ] {
            let error = FrameFilter::parse(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }

    #[cfg(feature = "dummies")]
    #[test]
    fn frames_are_found_by_the_dummy_term() {
        let terms = Terms::from_fn(|term| (term.key == "dummy").then_some(0.7));
        let row = FrameRow { terms: Some(&terms), ..row() };
        let holds = |text: &str| FrameFilter::parse(text).unwrap().matches(&row);
        assert!(holds("dummy>0.5 -dummy>0.8") && !holds("dummy<0.5") && !holds("bone>=0"));
        assert!(syntax().contains(" dummy:"), "{}", syntax());
    }

    #[test]
    fn only_rules_about_fits_follow_a_run() {
        assert!(FrameFilter::parse("iou<0.5").unwrap().reads().fit);
        assert!(!FrameFilter::parse("stratum:hard tag:F1 hardness>0.5 00").unwrap().reads().fit);
    }

    #[test]
    fn only_rules_about_labels_follow_tags() {
        for text in ["-tag:none", "note:wall", "by:ada", "verdict:true-negative"] {
            assert!(FrameFilter::parse(text).unwrap().reads().labels(), "{text}");
        }
        assert!(!FrameFilter::parse("stratum:hard iou<0.5 00").unwrap().reads().labels());
    }
}
