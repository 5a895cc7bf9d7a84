use super::*;

/// Somebody at `x` who looks along `yaw`.
pub(super) fn body(x: f64, yaw: f64, loss: f64) -> Hypothesis {
    Hypothesis {
        loss,
        network: 0.0,
        unlikeness: 1.0,
        yaw,
        away: 0.0,
        averted: 0.0,
        spin: 0.0,
        joints: [1.0, -1.0].map(|side| [x - 0.2 * side * yaw.sin(), 0.2 * side * yaw.cos(), 0.0]).to_vec(),
        velocities: vec![[0.0; 3]; 2],
        beta: vec![0.0; 2],
        still: 0.0,
    }
}

/// A frame of one person who may be this body alone.
pub(super) fn frame_of(body: Hypothesis) -> Hypotheses {
    searched(vec![vec![body]], Vec::new())
}

/// A frame whose maps no body explains, where a network expects one of these of each person.
fn unexplained(expected: Vec<Vec<Hypothesis>>) -> Hypotheses {
    searched(expected.iter().map(|_| vec![body(9.0, 0.0, 1.0)]).collect(), expected)
}

/// A frame in which a search ended at these bodies of each person, and a network expects those.
fn searched(persons: Vec<Vec<Hypothesis>>, expected: Vec<Vec<Hypothesis>>) -> Hypotheses {
    let moved = vec![[0.0; 3]; persons.len()];
    let searched = Searched { begun: 1.0, moved, persons, expected, network: Vec::new() };
    let found = Some(Ok(searched));
    Hypotheses { own: Vec::new(), persons: Vec::new(), searched: found, peaks: Vec::new(), notes: Vec::new() }
}

#[test]
fn whom_no_body_explains_is_the_one_that_a_network_expects_along_the_sequence() {
    let back = std::f64::consts::PI;
    let frame = |front: f64, of_back: f64| unexplained(vec![vec![body(3.0, back, of_back), body(3.0, 0.0, front)]]);
    let own = frame(1.1, 1.0);
    let searched = own.searched.as_ref().and_then(|searched| searched.as_ref().ok());
    assert!(searched.is_some_and(|searched| chosen(searched, &[]).is_none()));
    let yaw = |around: &[(f64, &Hypotheses)]| own.expected(around).map(|bodies| bodies[0].yaw);
    assert_eq!(yaw(&[]), Some(back));
    let other = frame(1.0, 1.3);
    assert_eq!(yaw(&[(-0.1, &other), (0.1, &other)]), Some(0.0));
}

#[test]
fn who_was_seen_last_where_a_network_expects_them_too_looks_as_it_says() {
    let before = frame_of(Hypothesis { unlikeness: 0.2, ..body(3.0, 0.0, 0.1) });
    let seen = |x: f64| {
        let own = unexplained(vec![vec![body(x, 2.0, 1.0)]]);
        own.seen_elsewhere(None, &[(-0.1, &before)]).map(|body| body.yaw)
    };
    assert_eq!((seen(3.2), seen(3.5)), (None, Some(0.0)));
    let unasked = unexplained(vec![Vec::new()]);
    assert!(unasked.seen_elsewhere(None, &[(-0.1, &before)]).is_some());
}

#[test]
fn several_are_expected_in_as_many_places() {
    let two = |x: f64| unexplained(vec![vec![body(3.0, 0.0, 1.0)], vec![body(x, 0.0, 1.0)]]);
    assert_eq!(two(3.5).expected(&[]).map(|bodies| bodies.len()), Some(2));
    assert!(two(3.2).expected(&[]).is_none());
    // Where the network is not asked, or knows nothing of one of them, there is nobody.
    assert!(unexplained(vec![vec![body(3.0, 0.0, 1.0)], Vec::new()]).expected(&[]).is_none());
}
