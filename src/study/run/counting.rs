//! The study `counting`: how often the number of people is right, by a [`Method`].

use super::row::RunNumbers;
use super::variant::Method;
use crate::dataset::{Dataset, Heatmap, map_cells};
use crate::mhp::fill_missing;
use crate::people::{CLASSES, Counter, MapNetwork, Network, map_image, map_statistics};
use crate::start::{LEAD_IN, ScanWindow};
use crate::study::row::annotated;
use crate::task::milliseconds;
use std::sync::Arc;
use std::time::Instant;

/// Frames of a unit: short enough for all cores, long against the frames that are read before it.
pub(super) const CHUNK: usize = 32;

/// One frame's count, and the time that it took without reading, ms.
pub(super) type CountOutcome = (Result<RunNumbers, String>, Option<f64>);

/// Counts consecutive frames of one sequence; those before them in it are looked at where the method asks for them.
pub(super) fn count(dataset: &Dataset, method: Method, frames: &[usize]) -> Vec<CountOutcome> {
    let Some(&first) = frames.first() else { return Vec::new() };
    let made = match method {
        Method::Counter => Counter::new(&dataset.info().views).map(|counter| Tool::Counter(Arc::new(counter))),
        Method::Maps => MapNetwork::bundled().map(Tool::Maps),
        Method::Alone | Method::Fit => Network::alone().map(Tool::Alone),
    };
    let tool = match made {
        Ok(tool) => tool,
        Err(error) => return frames.iter().map(|_| (Err(error.to_string()), None)).collect(),
    };
    match &tool {
        Tool::Alone(network) => {
            let answer = |maps: &[Heatmap]| network.probabilities(&map_statistics(&map_cells(maps)));
            frames.iter().map(|&frame| by_itself(dataset, &answer, frame)).collect()
        }
        Tool::Maps(network) => {
            let shaped = |maps: &[Heatmap]| {
                map_image(&maps.iter().map(|map| (&map.shape[..], &map.data[..])).collect::<Vec<_>>())
            };
            let answer = |maps: &[Heatmap]| network.probabilities(&shaped(maps));
            frames.iter().map(|&frame| by_itself(dataset, &answer, frame)).collect()
        }
        Tool::Counter(counter) => {
            let mut window = ScanWindow::new(counter);
            let sequence = dataset.sequence(first);
            let begin =
                (first.saturating_sub(LEAD_IN)..first).find(|&i| dataset.sequence(i) == sequence).unwrap_or(first);
            for before in begin..first {
                window.look_ahead(dataset, before);
                let _ = window.push(maps(dataset, before).map(|(maps, _)| maps));
            }
            frames.iter().map(|&frame| with_counter(dataset, &mut window, frame)).collect()
        }
    }
}

enum Tool {
    Counter(Arc<Counter>),
    Alone(Network),
    Maps(MapNetwork),
}

fn with_counter(dataset: &Dataset, window: &mut ScanWindow, frame: usize) -> CountOutcome {
    let (maps, annotated) = match maps(dataset, frame) {
        Ok((maps, annotated)) => (Ok(maps), annotated),
        Err(why) => (Err(why), None),
    };
    window.look_ahead(dataset, frame);
    let began = Instant::now();
    let count = window.push(maps);
    let ms = milliseconds(began);
    let numbers = count.map(|count| numbers(count.people(), annotated));
    let ms = numbers.is_ok().then_some(ms);
    (numbers.map_err(|why| super::fit::portable(dataset, &why)), ms)
}

/// By what a classifier answers of a frame's maps alone.
fn by_itself(dataset: &Dataset, answer: &dyn Fn(&[Heatmap]) -> [f64; CLASSES], frame: usize) -> CountOutcome {
    let (mut maps, annotated) = match maps(dataset, frame) {
        Ok(found) => found,
        Err(why) => return (Err(super::fit::portable(dataset, &why)), None),
    };
    let began = Instant::now();
    for map in &mut maps {
        let _ = fill_missing(&mut map.data, &map.shape);
    }
    let probabilities = answer(&maps);
    let people = (0..CLASSES).fold(0, |best, n| if probabilities[n] > probabilities[best] { n } else { best });
    (Ok(numbers(people, annotated)), Some(milliseconds(began)))
}

fn maps(dataset: &Dataset, frame: usize) -> Result<(Vec<Heatmap>, Option<usize>), String> {
    let frame = dataset.load(frame).map_err(|error| error.to_string())?;
    let annotated = annotated(&frame);
    Ok((frame.maps, annotated))
}

fn numbers(people: usize, annotated: Option<usize>) -> RunNumbers {
    RunNumbers { persons: people, annotated, reason: "counted".to_owned(), ..RunNumbers::default() }
}
