//! Breakpoints: conditions on the numbers of an iteration at which a run stops.
//!
//! A breakpoint stops a run at the first iteration that it holds at, and then again only after it did not hold in between: a run
//! that goes on is not stopped at every step. A fit that begins anew arms it again.

use super::language::{Comparison, comparison, split};
use super::quantity::{Iteration, Quantity, inside, known};
use crate::body::Skeleton;
use crate::geometry::Vec3;
use crate::mhp::Fitter;
use std::fmt;
use std::str::FromStr;

/// A condition, as it was typed and as it is understood.
#[derive(Debug, Clone, PartialEq)]
pub struct Breakpoint {
    text: String,
    terms: Vec<Term>,
}

#[derive(Debug, Clone, PartialEq)]
struct Term {
    negated: bool,
    test: Test,
}

#[derive(Debug, Clone, PartialEq)]
enum Test {
    Compare(Quantity, Comparison, f64),
    /// It rose, or fell, at each of so many iterations in a row.
    Trend {
        quantity: Quantity,
        rises: bool,
        iterations: usize,
    },
    /// A joint left the EM region of a view, or came into those of all, at this iteration.
    Region {
        joint: String,
        leaves: bool,
    },
}

/// What a breakpoint may say, for the tooltip of its field and the help of the command line.
pub fn syntax() -> String {
    format!(
        "Terms that must all hold, separated by spaces; - negates:\n\
        iou<0.4 · step_mm>20 · iteration=30 · l_bone rises 5 · loss falls 3 · em·kine<-0.9 · joint \"left knee\" leaves region\n\
        step_mm: the longest way of a joint in a step; em·kine: the cosine between two gradients in the joints' positions; \
        rises N: at each of N iterations in a row; a joint leaves the region where it leaves that of a view, and enters it where \
        it is in all of them.\n\
        Numbers: {}.",
        known()
    )
}

impl fmt::Display for Breakpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Breakpoint {
    type Err = String;

    /// Reads a condition; one line that names the term and what was expected.
    fn from_str(text: &str) -> Result<Self, String> {
        let words = split(text)?;
        let (mut terms, mut rest) = (Vec::new(), words.as_slice());
        while !rest.is_empty() {
            let (term, used) = term(rest)?;
            terms.push(term);
            rest = &rest[used..];
        }
        if terms.is_empty() {
            return Err("an empty condition holds nowhere; expected for example iou<0.4".into());
        }
        Ok(Self { text: text.trim().to_owned(), terms })
    }
}

impl Breakpoint {
    /// Checks what only a data set knows: its joints and its maps.
    ///
    /// # Errors
    /// One line that names what there is not, and what there is.
    pub fn check(&self, skeleton: &Skeleton, arrays: &[&str]) -> Result<(), String> {
        for term in &self.terms {
            match &term.test {
                Test::Region { joint, .. } if joints(skeleton, joint).is_empty() => {
                    let names: Vec<String> = (0..skeleton.joints.len()).map(|k| skeleton.shown_name(k)).collect();
                    return Err(format!("`{joint}` is no joint; expected one of {}", names.join(", ")));
                }
                Test::Compare(Quantity::IouOf(array), ..) | Test::Trend { quantity: Quantity::IouOf(array), .. }
                    if !arrays.contains(&array.as_str()) =>
                {
                    return Err(format!("`iou_{array}`: no such map; expected one of {}", arrays.join(", ")));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// The first term of these words, and how many of them it is.
fn term(words: &[String]) -> Result<(Term, usize), String> {
    let Some(first) = words.first() else { return Err("a term is missing".into()) };
    let (negated, first) = first.strip_prefix('-').map_or((false, first.as_str()), |rest| (true, rest));
    let word = |k: usize| words.get(k).map(String::as_str);
    if first.eq_ignore_ascii_case("joint") {
        let leaves = match (word(2).unwrap_or_default().to_lowercase().as_str(), word(3)) {
            ("leaves", Some("region")) => true,
            ("enters", Some("region")) => false,
            _ => return Err("`joint`: expected joint \"left knee\" leaves region, or enters region".into()),
        };
        let joint = word(1).unwrap_or_default().to_owned();
        return Ok((Term { negated, test: Test::Region { joint, leaves } }, 4));
    }
    let trend = word(1).map(str::to_lowercase);
    if let Some(rises) = trend.as_deref().and_then(|word| match word {
        "rises" => Some(true),
        "falls" => Some(false),
        _ => None,
    }) {
        let count = word(2).unwrap_or_default();
        let iterations = count.parse::<usize>().ok().filter(|n| (1..=10_000).contains(n)).ok_or_else(|| {
            format!("`{first} {} {count}`: expected a number of iterations, as in l_bone rises 5", words[1])
        })?;
        return Ok((Term { negated, test: Test::Trend { quantity: Quantity::of(first)?, rises, iterations } }, 3));
    }
    match comparison(first) {
        Some(parts) => {
            let (key, comparison, limit) = parts?;
            Ok((Term { negated, test: Test::Compare(Quantity::of(key)?, comparison, limit) }, 1))
        }
        None => Err(format!(
            "`{first}` is no condition; expected a comparison (iou<0.4), a trend (l_bone rises 5) or joint \"left knee\" leaves region"
        )),
    }
}

/// The joints of this name, in the skeleton's own words or as they are shown.
fn joints(skeleton: &Skeleton, name: &str) -> Vec<usize> {
    let plain = |name: &str| name.to_lowercase().replace(['_', '-'], " ");
    let wanted = plain(name);
    (0..skeleton.joints.len())
        .filter(|&k| plain(&skeleton.joints[k]) == wanted || plain(&skeleton.shown_name(k)) == wanted)
        .collect()
}

/// What watches a run: its breakpoints, and what they need of the iterations before.
#[derive(Debug, Default)]
pub struct Watch {
    breakpoints: Vec<Watched>,
    before: Vec<Vec3>,
    inside: Vec<bool>,
}

#[derive(Debug)]
struct Watched {
    of: Breakpoint,
    armed: bool,
    /// A trend's last value and how often in a row it went its way, in the order of the terms.
    trends: Vec<(Option<f64>, usize)>,
}

impl Watch {
    /// Of these breakpoints.
    pub fn new(breakpoints: Vec<Breakpoint>) -> Self {
        let watched = |of: Breakpoint| Watched { trends: vec![(None, 0); of.terms.len()], armed: true, of };
        Self { breakpoints: breakpoints.into_iter().map(watched).collect(), ..Self::default() }
    }

    /// Whether there is nothing to watch for.
    pub fn is_empty(&self) -> bool {
        self.breakpoints.is_empty()
    }

    /// Others are watched for from now on; what is known of those that stay, stays.
    pub fn replace(&mut self, breakpoints: Vec<Breakpoint>, fitter: &Fitter, majpe_mm: Option<f64>) {
        let mut old = std::mem::take(&mut self.breakpoints);
        let was_empty = old.is_empty();
        self.breakpoints = Self::new(breakpoints).breakpoints;
        if was_empty {
            return self.begin(fitter, majpe_mm);
        }
        for new in &mut self.breakpoints {
            if let Some(at) = old.iter().position(|known| known.of == new.of) {
                *new = old.swap_remove(at);
            }
        }
    }

    /// A fit begins where the fitter stands; what was seen before is forgotten.
    pub fn begin(&mut self, fitter: &Fitter, majpe_mm: Option<f64>) {
        if self.is_empty() {
            return;
        }
        for watched in &mut self.breakpoints {
            watched.armed = true;
            watched.trends.fill((None, 0));
        }
        self.before.clear();
        self.inside = inside(fitter);
        // The first values of the trends; nobody is stopped where he begins.
        self.look(fitter, majpe_mm);
        self.breakpoints.iter_mut().for_each(|watched| watched.armed = true);
    }

    /// A step was taken. Answers which breakpoint stops the run here, by its place in the list.
    pub fn step(&mut self, fitter: &Fitter, majpe_mm: Option<f64>) -> Option<usize> {
        if self.is_empty() { None } else { self.look(fitter, majpe_mm) }
    }

    fn look(&mut self, fitter: &Fitter, majpe_mm: Option<f64>) -> Option<usize> {
        let Self { breakpoints, before, inside: was_inside } = self;
        let now = Iteration { fitter, before, majpe_mm };
        let is_inside = inside(fitter);
        let mut stops = None;
        for (k, watched) in breakpoints.iter_mut().enumerate() {
            let holds = watched.holds(&now, (was_inside, &is_inside));
            if holds && watched.armed && stops.is_none() {
                stops = Some(k);
                watched.armed = false;
            } else if !holds {
                watched.armed = true;
            }
        }
        before.clear();
        before.extend_from_slice(fitter.params().positions());
        *was_inside = is_inside;
        stops
    }
}

impl Watched {
    fn holds(&mut self, now: &Iteration<'_>, (was, is): (&[bool], &[bool])) -> bool {
        let Self { of, trends, .. } = self;
        let mut all = true;
        // Every term is asked: trends count on.
        for (term, trend) in of.terms.iter().zip(trends) {
            let holds = match &term.test {
                Test::Compare(quantity, comparison, limit) => {
                    quantity.value(now).is_some_and(|value| comparison.holds(value, *limit))
                }
                Test::Trend { quantity, rises, iterations } => {
                    let value = quantity.value(now);
                    let (last, count) = trend;
                    let goes =
                        value.zip(*last).is_some_and(|(now, before)| if *rises { now > before } else { now < before });
                    *count = if goes { *count + 1 } else { 0 };
                    *last = value;
                    *count >= *iterations
                }
                Test::Region { joint, leaves } => {
                    let skeleton = &now.fitter.objective().problem().skeleton;
                    let named = joints(skeleton, joint);
                    let a_person = skeleton.joints.len().max(1);
                    let crossed =
                        |k: usize| was.get(k).zip(is.get(k)).is_some_and(|(was, is)| was != is && *is != *leaves);
                    (0..is.len()).any(|k| named.contains(&(k % a_person)) && crossed(k))
                }
            };
            all &= holds != term.negated;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn every_form_of_the_language_is_understood() {
        for text in [
            "iou<0.4",
            "step_mm>20",
            "l_bone rises 5",
            "em·kine<-0.9",
            "em*prior>=0",
            "iteration=30",
            "joint \"left knee\" leaves region",
            "joint left_knee enters region",
            "iou_hm_hori<0.2 -iteration<10 LOSS falls 3",
            "majpe>200",
            "grad<1e-3",
        ] {
            let parsed: Breakpoint = text.parse().unwrap();
            assert_eq!(parsed.to_string(), text);
        }
        let and: Breakpoint = "iou<0.4 l_bone rises 5 joint nose leaves region".parse().unwrap();
        assert_eq!(and.terms.len(), 3);
    }

    #[test]
    fn what_is_wrong_is_told() {
        for (text, expected) in [
            ("", "an empty condition"),
            ("iou", "is no condition"),
            ("iou<x", "`x` is not a number"),
            ("foo<1", "`foo` is no number of an iteration; expected iteration, loss"),
            ("em·foo<1", "a cosine of two gradients"),
            ("l_bone rises", "expected a number of iterations"),
            ("l_bone rises 0", "expected a number of iterations"),
            ("joint knee", "leaves region"),
            ("joint \"knee", "quote"),
        ] {
            let error = text.parse::<Breakpoint>().unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
        let skeleton = Skeleton::preset("coco17").unwrap();
        let check = |text: &str| text.parse::<Breakpoint>().unwrap().check(&skeleton, &["hm_hori"]);
        assert!(check("joint elbow leaves region").unwrap_err().contains("left elbow"));
        assert!(check("iou_hm_vert<0.5").unwrap_err().contains("expected one of hm_hori"));
        assert!(check("joint \"Left Knee\" leaves region iou_hm_hori<0.5").is_ok());
    }
}
