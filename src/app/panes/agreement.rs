//! How far two annotators agree, or one and the machine: a row a tag, and the frames in dispute one click away.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::labels::{MACHINE_THRESHOLD, Record, Tag, TagAgreement, Tags, against_machine, compare_tags};
use crate::session::{Command, LabelMode, Labels, Records, Session};
use egui::{Key, RichText, Role, Ui};
use std::cmp::Ordering;
use std::collections::HashMap;

/// The machine as one of the two.
const MACHINE: &str = "machine";
/// Disputes that are listed at most.
const LISTED: usize = 200;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Agreement",
    title: "Agreement",
    icon: &[Mark::Ring([5.7, 8.0], 4.5), Mark::Ring([10.3, 8.0], 4.5)],
    help: "how far two annotators agree, or one and the machine",
    dock: Dock::Centre,
    keys: &[(CTRL, Key::Num3)],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| choose(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Whose labels are compared, what came out, and which disputes are listed.
#[derive(Default)]
struct State {
    pair: [String; 2],
    found: Option<(MadeFrom, Found)>,
    listed: Option<Listed>,
}

impl PaneState for State {}

/// What the comparison was made from.
type MadeFrom = (u64, [String; 2]);

struct Found {
    /// Frames that both judged.
    frames: usize,
    only_in_a: usize,
    only_in_b: usize,
    tags: Vec<(Tag, TagAgreement)>,
    pooled: TagAgreement,
    disputes: Vec<Dispute>,
    remark: Option<String>,
}

/// A decision that differs: the frame, the tag, and whether it was A who gave it.
struct Dispute {
    frame: usize,
    tag: Tag,
    a: bool,
}

/// A cell of a table: the tag, and what A and B said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Listed {
    tag: Tag,
    a: bool,
    b: bool,
}

/// Who has said something.
fn names(labels: &Labels) -> Vec<&String> {
    labels.table().iter().filter(|(_, records)| !records.is_empty()).map(|(name, _)| name).collect()
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Once somebody has tagged frames, choose two annotators, or one and the machine, to see Cohen's κ of each \
               tag and the frames in dispute. Another annotator's journal lies beside the data, or comes with \
               `mhp-inspector labels import`.";
    names(&session.labels).is_empty().then(|| Blank::new("No labels to compare", how))
}

/// Who is compared with whom.
fn choose(ui: &mut Ui, shared: &Shared<'_>, state: &mut State) {
    let labels = &shared.session.labels;
    let names = names(labels);
    let Some(first) = names.first() else { return };
    if !names.iter().any(|name| **name == state.pair[0]) {
        let mine = names.iter().find(|name| ***name == labels.annotator);
        state.pair[0].clone_from(mine.unwrap_or(first));
    }
    if state.pair[1] != MACHINE && (!names.iter().any(|name| **name == state.pair[1]) || state.pair[0] == state.pair[1])
    {
        let other = names.iter().find(|name| ***name != state.pair[0]);
        state.pair[1] = other.map_or_else(|| MACHINE.to_owned(), |name| (*name).clone());
    }
    if shared.session.view.label_mode == LabelMode::Agreement {
        // Two others' disputes would tell what they said of frames that are still to be judged.
        state.pair[0].clone_from(&labels.annotator);
        let text = "A is you while you label for agreement; only frames that you have judged are counted.";
        ui.label(RichText::new(text).small().color(Tokens::of(ui).dim));
    }
    pair(ui, state, &names);
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let labels = &shared.session.labels;
    let tokens = Tokens::of(ui);
    let key = (labels.revision(), state.pair.clone());
    if state.found.as_ref().is_none_or(|(known, _)| *known != key) {
        state.found = Some((key, compute(labels, &state.pair)));
    }
    let Some((_, found)) = &state.found else { return };
    let mut listed = state.listed;
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        summary(ui, found, &state.pair, &tokens);
        table(ui, found, &mut listed, &tokens);
        disputes(ui, shared, &found.disputes, listed, &state.pair, &tokens);
    });
    state.listed = listed;
}

fn pair(ui: &mut Ui, state: &mut State, names: &[&String]) {
    ui.horizontal(|ui| {
        for (k, word) in ["A", "B"].into_iter().enumerate() {
            ui.label(RichText::new(word).font(theme::strong(12.0)));
            let mut chosen = state.pair[k].clone();
            let menu =
                egui::ComboBox::from_id_salt(("annotator", k)).width(110.0).selected_text(&chosen).show_ui(ui, |ui| {
                    for name in names {
                        ui.selectable_value(&mut chosen, (*name).clone(), *name);
                    }
                    if k == 1 {
                        let tip =
                            "The evidence scores that were recorded when A judged; from 0.5 on the machine says yes.";
                        ui.selectable_value(&mut chosen, MACHINE.to_owned(), MACHINE).on_hover_text(tip);
                    }
                });
            menu.response.named(Role::ComboBox, &format!("Annotator {word}"));
            if chosen != state.pair[k] {
                state.pair[k] = chosen;
                state.listed = None;
            }
        }
    });
}

fn compute(labels: &Labels, pair: &[String; 2]) -> Found {
    let records = |name: &String| labels.table().get(name);
    let Some(a) = records(&pair[0]) else { return between(&Records::default(), &Records::default()) };
    if pair[1] == MACHINE {
        with_machine(a)
    } else {
        records(&pair[1]).map_or_else(|| between(a, a), |b| between(a, b))
    }
}

/// Two people: both lists are in the order of the data set, so that one walk along them finds what both judged.
fn between(a: &Records, b: &Records) -> Found {
    let (a, b): (Vec<_>, Vec<_>) = (a.judged().collect(), b.judged().collect());
    let (mut both, mut disputes): (Vec<(Tags, Tags)>, _) = (Vec::new(), Vec::new());
    let (mut i, mut j) = (0, 0);
    while let (Some(&(frame, of_a)), Some(&(other, of_b))) = (a.get(i), b.get(j)) {
        match frame.cmp(&other) {
            Ordering::Less => i += 1,
            Ordering::Greater => j += 1,
            Ordering::Equal => {
                both.push((of_a, of_b));
                let differing = of_a.minus(of_b).union(of_b.minus(of_a));
                disputes.extend(differing.iter().map(|tag| Dispute { frame, tag, a: of_a.contains(tag) }));
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    let (tags, pooled) = compare_tags(&both);
    let frames = both.len();
    let (only_in_a, only_in_b) = (a.len() - frames, b.len() - frames);
    Found { frames, only_in_a, only_in_b, tags, pooled, disputes, remark: None }
}

/// One person and the machine's scores at that time.
fn with_machine(a: &Records) -> Found {
    let (scored, others): (Vec<_>, Vec<_>) = a.judged().map(|(frame, _)| frame).partition(|&frame| a.is_scored(frame));
    let judged: Vec<(usize, &Record)> = scored.into_iter().filter_map(|frame| Some((frame, a.get(frame)?))).collect();
    let machine = against_machine(judged.iter().map(|(_, record)| *record), MACHINE_THRESHOLD);
    let unscored = machine.unscored + others.len();
    let frames: HashMap<&str, usize> = if machine.agreement.disputes.is_empty() {
        HashMap::new()
    } else {
        judged.iter().map(|(frame, record)| (record.frame.path.as_str(), *frame)).collect()
    };
    let mut remarks = Vec::new();
    let counted = machine.agreement.frames;
    if machine.shown > 0 {
        remarks.push(format!("{} of {counted} were judged with the scores on screen: not blind", machine.shown));
    }
    if unscored > 0 {
        remarks.push(format!("{unscored} were judged without a score"));
    }
    let place = |dispute: &crate::labels::Dispute| {
        Some(Dispute { frame: *frames.get(dispute.frame.as_str())?, tag: dispute.tag, a: dispute.a })
    };
    let disputes = machine.agreement.disputes.iter().filter_map(place).collect();
    let crate::labels::Agreement { only_in_b, tags, pooled, .. } = machine.agreement;
    let remark = (!remarks.is_empty()).then(|| remarks.join("; "));
    Found { frames: counted, only_in_a: unscored, only_in_b, tags, pooled, disputes, remark }
}

fn summary(ui: &mut Ui, found: &Found, pair: &[String; 2], tokens: &Tokens) {
    let both = format!(
        "{} judged by both",
        if found.frames == 1 { "1 frame".to_owned() } else { format!("{} frames", found.frames) }
    );
    let text = if pair[1] == MACHINE {
        both
    } else {
        let (a, b) = (found.only_in_a, found.only_in_b);
        format!("{both} · {a} only by {} · {b} only by {}", pair[0], pair[1])
    };
    ui.label(RichText::new(text).small().color(tokens.dim));
    if let Some(remark) = &found.remark {
        ui.label(RichText::new(format!("△ {remark}")).small().color(tokens.warn));
    }
}

fn table(ui: &mut Ui, found: &Found, listed: &mut Option<Listed>, tokens: &Tokens) {
    egui::Grid::new("agreement").num_columns(9).spacing([12.0, 3.0]).show(ui, |ui| {
        for (title, tip) in [
            ("", ""),
            ("κ", "Cohen's kappa: agreement beyond chance; 1 full, 0 none. – where undefined: both always said the same one thing."),
            ("raw", "Share of equal decisions."),
            ("both", "Frames that both tagged."),
            ("only A", "Frames that only A tagged. Click the number to list them."),
            ("only B", "Frames that only B tagged. Click the number to list them."),
            ("neither", "Frames that neither tagged."),
            ("prev. A", "Prevalence: share of frames that A tagged."),
            ("prev. B", "Prevalence: share of frames that B tagged."),
        ] {
            ui.label(RichText::new(title).small().color(tokens.dim)).on_hover_text(tip);
        }
        ui.end_row();
        for (tag, row) in &found.tags {
            ui.label(RichText::new(tag.code()).font(theme::strong(12.0)).color(tokens.tag(*tag))).on_hover_text(tag.words());
            cells(ui, row, Some(*tag), listed, tokens);
        }
        ui.label(RichText::new("pooled").font(theme::strong(12.0))).on_hover_text("All decisions of all tags in one table.");
        cells(ui, &found.pooled, None, listed, tokens);
    });
}

fn cells(ui: &mut Ui, row: &TagAgreement, tag: Option<Tag>, listed: &mut Option<Listed>, tokens: &Tokens) {
    let number = |value: Option<f64>, digits: usize| value.map_or_else(|| "–".into(), |x| format!("{x:.digits$}"));
    let mono = |text: String| RichText::new(text).font(theme::mono(theme::CAPTION));
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.label(mono(number(row.kappa, 2)));
        if let Some(why) = &row.unreliable {
            ui.label(RichText::new("△").small().color(tokens.warn)).on_hover_text(format!("Not reliable: {why}"));
        }
    });
    ui.label(mono(number(row.raw, 2)));
    ui.label(mono(row.both.to_string()));
    for (a, count, word) in [(true, row.only_a, "only A"), (false, row.only_b, "only B")] {
        match tag.filter(|_| count > 0) {
            Some(tag) => {
                let cell = Listed { tag, a, b: !a };
                let on = *listed == Some(cell);
                let button = ui.selectable_label(on, mono(count.to_string()));
                if button
                    .named(Role::Button, &format!("{tag} {word}"))
                    .on_hover_text("List these frames below.")
                    .clicked()
                {
                    *listed = (!on).then_some(cell);
                }
            }
            None => {
                ui.label(mono(count.to_string()));
            }
        }
    }
    ui.label(mono(row.neither.to_string()));
    for share in [row.prevalence_a, row.prevalence_b] {
        ui.label(mono(number(share.map(|x| x * 100.0), 0) + if share.is_some() { " %" } else { "" }));
    }
    ui.end_row();
}

/// The frames in dispute, each a link.
fn disputes(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    disputes: &[Dispute],
    listed: Option<Listed>,
    pair: &[String; 2],
    tokens: &Tokens,
) {
    let wanted = |d: &&Dispute| listed.is_none_or(|cell| (d.tag, d.a) == (cell.tag, cell.a));
    let count = disputes.iter().filter(wanted).count();
    let title = match listed {
        Some(Listed { tag, a, .. }) => {
            format!("{count} frames where only {} gave {tag}", pair[usize::from(!a)])
        }
        None => format!("{count} decisions in dispute"),
    };
    ui.add_space(4.0);
    ui.label(RichText::new(title).small().color(tokens.dim));
    let Some(dataset) = shared.session.data.dataset.clone() else { return };
    let mut go = None;
    for dispute in disputes.iter().filter(wanted).take(LISTED) {
        let name = dataset.frame_name(dispute.frame);
        ui.horizontal(|ui| {
            ui.label(RichText::new(dispute.tag.code()).small().color(tokens.tag(dispute.tag)));
            let link = ui.link(RichText::new(name).small());
            if link.named(Role::Link, &format!("Dispute {} {name}", dispute.tag)).clicked() {
                go = Some(dispute.frame);
            }
            let who = if dispute.a { &pair[0] } else { &pair[1] };
            ui.label(RichText::new(format!("by {who} only")).small().color(tokens.dim));
        });
    }
    if count > LISTED {
        ui.label(RichText::new(format!("and {} more", count - LISTED)).small().color(tokens.dim));
    }
    if let Some(frame) = go {
        shared.send(Command::GotoFrame(frame));
    }
}
