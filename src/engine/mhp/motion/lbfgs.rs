//! Limited-memory BFGS (Nocedal and Wright, *Numerical Optimization*, algorithms 3.1 and 7.4): the descent that ends a search.
//!
//! A window has a few dozen coordinates whose losses bend differently by orders of magnitude; the bend that the last steps met
//! makes the next ones as long as they should be. A step is shortened, by a parabola, until the loss falls by a share of what its slope
//! promises, and goes no farther than a unit of any coordinate.

use std::collections::VecDeque;

/// Steps that are remembered.
const MEMORY: usize = 8;
/// Units of the first step, which knows nothing of the bend, and of any other.
const FIRST: f64 = 0.3;
const MOST: f64 = 1.0;
/// The share of the promised fall that is enough.
const ENOUGH: f64 = 1e-4;
/// What a step that is too long is shortened to, at least and at most.
const SHORTER: [f64; 2] = [0.1, 0.5];
/// A bend that is flatter than this, in its own lengths, tells nothing.
const FLAT: f64 = 1e-10;

/// A step, what it changed of the gradient, and one by their product.
struct Step {
    moved: Vec<f64>,
    bent: Vec<f64>,
    rho: f64,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn largest(of: &[f64]) -> f64 {
    of.iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// The negative gradient, by the inverse of the bend that the remembered steps met.
fn direction(gradient: &[f64], memory: &VecDeque<Step>) -> Vec<f64> {
    let add = |way: &mut [f64], of: &[f64], gain: f64| way.iter_mut().zip(of).for_each(|(way, of)| *way += gain * of);
    let mut way: Vec<f64> = gradient.iter().map(|slope| -slope).collect();
    let mut gains = [0.0; MEMORY];
    for (step, gain) in memory.iter().zip(&mut gains).rev() {
        *gain = step.rho * dot(&step.moved, &way);
        add(&mut way, &step.bent, -*gain);
    }
    if let Some(last) = memory.back() {
        let flatness = 1.0 / (last.rho * dot(&last.bent, &last.bent));
        for x in &mut way {
            *x *= flatness;
        }
    }
    for (step, gain) in memory.iter().zip(gains) {
        let back = step.rho * dot(&step.bent, &way);
        add(&mut way, &step.moved, gain - back);
    }
    way
}

/// Lowers `loss`, which writes its gradient, from `x` on, with `evaluations` beside the first; `x` is where it is lowest. A coordinate whose
/// `unit` is zero stays.
pub(super) fn minimise(
    x: &mut Vec<f64>,
    units: &[f64],
    evaluations: usize,
    mut loss: impl FnMut(&[f64], &mut Vec<f64>) -> f64,
) {
    let mut raw = Vec::with_capacity(x.len());
    let mut at = |x: &[f64], gradient: &mut Vec<f64>| {
        let loss = loss(x, &mut raw);
        gradient.clear();
        gradient.extend(raw.iter().zip(units).map(|(slope, unit)| slope * unit));
        loss
    };
    let (mut gradient, mut there) = (Vec::new(), Vec::new());
    let mut lowest = at(x, &mut gradient);
    let mut memory: VecDeque<Step> = VecDeque::with_capacity(MEMORY);
    let mut left = evaluations;
    while left > 0 {
        let mut way = direction(&gradient, &memory);
        if dot(&way, &gradient).is_nan() || dot(&way, &gradient) >= 0.0 {
            memory.clear();
            way = direction(&gradient, &memory);
        }
        let most = if memory.is_empty() { FIRST } else { MOST };
        let long = largest(&way);
        if !(long.is_finite() && long > 0.0 && lowest.is_finite()) {
            return;
        }
        if memory.is_empty() || long > most {
            for x in &mut way {
                *x *= most / long;
            }
        }
        let slope = dot(&way, &gradient);
        let mut share = 1.0;
        loop {
            let next: Vec<f64> = x.iter().zip(&way).zip(units).map(|((x, way), unit)| x + share * way * unit).collect();
            left -= 1;
            let found = at(&next, &mut there);
            if found <= lowest + ENOUGH * share * slope {
                let moved: Vec<f64> = way.iter().map(|way| share * way).collect();
                let bent: Vec<f64> = there.iter().zip(&gradient).map(|(there, here)| there - here).collect();
                let product = dot(&moved, &bent);
                if product > FLAT * (dot(&moved, &moved) * dot(&bent, &bent)).sqrt() {
                    if memory.len() == MEMORY {
                        memory.pop_front();
                    }
                    memory.push_back(Step { moved, bent, rho: 1.0 / product });
                }
                (*x, lowest) = (next, found);
                std::mem::swap(&mut gradient, &mut there);
                break;
            }
            if left == 0 {
                return;
            }
            let bend = found - lowest - share * slope;
            let vertex = if bend.is_finite() { -0.5 * slope * share / bend } else { 0.0 };
            share *= vertex.clamp(SHORTER[0], SHORTER[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley in the first two and a parabola ten thousand times as steep in the third.
    fn valley(x: &[f64], gradient: &mut Vec<f64>) -> f64 {
        let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
        gradient.clear();
        gradient.extend([-2.0 * a - 400.0 * x[0] * b, 200.0 * b, 2e4 * (x[2] - 3.0)]);
        a * a + 100.0 * b * b + 1e4 * (x[2] - 3.0).powi(2)
    }

    #[test]
    fn it_ends_in_the_valley_within_its_evaluations() {
        let mut x = vec![-1.2, 1.0, 2.98];
        let mut calls = 0;
        let mut last = f64::INFINITY;
        minimise(&mut x, &[1.0, 1.0, 0.01], 70, |x, gradient| {
            calls += 1;
            last = last.min(valley(x, gradient));
            valley(x, gradient)
        });
        assert!(calls <= 71, "{calls}");
        assert!((x[0] - 1.0).abs() < 1e-4 && (x[1] - 1.0).abs() < 1e-4 && (x[2] - 3.0).abs() < 1e-5, "{x:?}");
        assert_eq!(valley(&x, &mut Vec::new()), last, "it stays at the lowest that it met");
    }

    #[test]
    fn few_evaluations_lower_it_and_held_coordinates_stay() {
        for evaluations in 0..12 {
            let start = vec![-1.2, 1.0, 2.98];
            let (mut x, mut calls) = (start.clone(), 0);
            minimise(&mut x, &[1.0, 0.0, 0.01], evaluations, |x, gradient| {
                calls += 1;
                valley(x, gradient)
            });
            assert!(calls <= evaluations + 1 && x[1] == 1.0);
            assert!(valley(&x, &mut Vec::new()) <= valley(&start, &mut Vec::new()));
        }
    }

    #[test]
    fn what_is_not_finite_is_not_entered() {
        let mut x = vec![0.5];
        minimise(&mut x, &[1.0], 50, |x, gradient| {
            *gradient = vec![if x[0] < 0.0 { f64::NAN } else { 1.0 }];
            if x[0] < 0.0 { f64::NAN } else { x[0] }
        });
        assert!((0.0..0.1).contains(&x[0]), "{x:?}");
        let mut stuck = vec![1.0];
        minimise(&mut stuck, &[1.0], 9, |_, gradient| {
            *gradient = vec![f64::NAN];
            f64::NAN
        });
        assert_eq!(stuck, [1.0]);
    }
}
