//! The look: tokens, fonts, spacing. Every colour of the window comes from here; only data is saturated.

use crate::body::Side;
use crate::labels::Tag;
use crate::mhp::{Hue, TermGroup, TermId};
use crate::session::ThemeChoice;
use crate::study::complexity::Stratum;
use egui::{Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Stroke, TextStyle, Visuals};
use std::sync::Arc;

/// Body text, points.
pub(crate) const BODY: f32 = 13.0;
/// Captions, ticks and dense tables, points.
pub(crate) const CAPTION: f32 = 11.0;
/// Pane titles, points.
pub(crate) const TITLE: f32 = 14.0;
/// The grid that distances are multiples of, points.
pub(crate) const GRID: f32 = 4.0;

/// The colours of one theme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tokens {
    /// Behind data.
    pub(crate) canvas: Color32,
    /// Behind controls.
    pub(crate) panel: Color32,
    /// Buttons, fields, selected rows.
    pub(crate) raised: Color32,
    /// Lines between things.
    pub(crate) stroke: Color32,
    /// Text.
    pub(crate) text: Color32,
    /// Secondary text.
    pub(crate) dim: Color32,
    /// Selection and focus.
    pub(crate) accent: Color32,
    /// Good.
    pub(crate) ok: Color32,
    /// Attention.
    pub(crate) warn: Color32,
    /// Wrong.
    pub(crate) bad: Color32,
    /// The person's left.
    pub(crate) left: Color32,
    /// The person's right.
    pub(crate) right: Color32,
    /// The selected joint.
    pub(crate) selected: Color32,
    /// The truth's skeleton.
    pub(crate) truth: Color32,
    /// A pinned fit that others are compared with.
    pub(crate) pin: Color32,
    /// True in the dark theme.
    pub(crate) dark: bool,
}

const fn rgb(hex: u32) -> Color32 {
    Color32::from_rgb((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

/// The dark theme.
pub(crate) const DARK: Tokens = Tokens {
    canvas: rgb(0x101216),
    panel: rgb(0x171A20),
    raised: rgb(0x1F232B),
    stroke: rgb(0x2B303A),
    text: rgb(0xE6E8EB),
    dim: rgb(0x9AA3AF),
    accent: rgb(0x9797FC),
    ok: rgb(0x5CC98B),
    warn: rgb(0xF2B84B),
    bad: rgb(0xF2655C),
    left: rgb(0x4DA3FF),
    right: rgb(0xFF9F45),
    selected: rgb(0xFE69D5),
    truth: rgb(0x9BEC44),
    pin: rgb(0xBA7AFB),
    dark: true,
};

/// The light theme.
pub(crate) const LIGHT: Tokens = Tokens {
    canvas: rgb(0xFFFFFF),
    panel: rgb(0xF5F6F8),
    raised: rgb(0xFFFFFF),
    stroke: rgb(0xD9DDE3),
    text: rgb(0x1B1F24),
    dim: rgb(0x5C6570),
    accent: rgb(0x584ACA),
    ok: rgb(0x1E8A52),
    warn: rgb(0xA66A00),
    bad: rgb(0xC6372E),
    left: rgb(0x1769C2),
    right: rgb(0xC25E00),
    selected: rgb(0xC40A8F),
    truth: rgb(0x599305),
    pin: rgb(0x7F22BB),
    dark: false,
};

/// Mask overlay: cells in both masks, in H_ori's only, in H_sim's only.
pub(crate) const MASK_BOTH: Color32 = Color32::from_rgb(0xFF, 0xFF, 0xFF);
/// In H_ori's mask only.
pub(crate) const MASK_ORI: Color32 = Color32::from_rgb(0xE6, 0xC8, 0x4A);
/// In H_sim's mask only.
pub(crate) const MASK_SIM: Color32 = Color32::from_rgb(0x2F, 0xCC, 0xCB);
/// Behind the masks, in both themes: white must be readable on it.
pub(crate) const MASK_GROUND: Color32 = Color32::from_rgb(0x10, 0x12, 0x16);
/// Cells that hold no number.
pub(crate) const NAN_CELL: Color32 = Color32::from_rgb(0xB0, 0x3A, 0x9A);

impl Tokens {
    /// The tokens of the theme that `ui` is drawn in.
    pub(crate) fn of(ui: &egui::Ui) -> Self {
        Self::of_visuals(ui.visuals())
    }

    /// The tokens of what is drawn with these visuals.
    pub(crate) fn of_visuals(visuals: &egui::Visuals) -> Self {
        if visuals.dark_mode { DARK } else { LIGHT }
    }

    /// The colour of a side of the body.
    pub(crate) fn side(&self, side: Side) -> Color32 {
        match side {
            Side::Left => self.left,
            Side::Right => self.right,
            Side::Middle => self.dim,
        }
    }

    /// The colour of a person among several, by identity: six that colour-blind eyes tell apart (Okabe and Ito), then again from
    /// the first. The number beside the person says the same.
    pub(crate) fn person(&self, identity: usize) -> Color32 {
        const ON_DARK: [u32; 6] = [0x56B4E9, 0xE69F00, 0x00B886, 0xD98AB3, 0xF0E442, 0xF0733A];
        const ON_LIGHT: [u32; 6] = [0x1B75B0, 0xB96F02, 0x00785A, 0xA34F7C, 0x8A7B00, 0xB94700];
        let colors = if self.dark { ON_DARK } else { ON_LIGHT };
        rgb(colors[identity % colors.len()])
    }

    /// The colour of a source of predictions, by the order in which they were opened, then again from the first.
    pub(crate) fn source(&self, hue: usize) -> Color32 {
        const ON_DARK: [u32; 6] = [0xFF8FA3, 0x35D0BA, 0xD6B656, 0x7FB2FF, 0xE08BFF, 0xB5E06B];
        const ON_LIGHT: [u32; 6] = [0xB3284A, 0x007F6E, 0x806000, 0x2456B8, 0x8E24AA, 0x4B7300];
        let colors = if self.dark { ON_DARK } else { ON_LIGHT };
        rgb(colors[hue % colors.len()])
    }

    /// The colour that a source names itself, or the one that it has by its order.
    pub(crate) fn of_source(&self, source: &crate::session::Source) -> Color32 {
        let own = source.colour.map(|colour| colour.0);
        own.map_or_else(|| self.source(source.hue), |[r, g, b]| Color32::from_rgb(r, g, b))
    }

    /// The one of two colours that is of this theme.
    fn pick(&self, on_dark: u32, on_light: u32) -> Color32 {
        rgb(if self.dark { on_dark } else { on_light })
    }

    /// The colour of a stratum; a letter or a height says the same.
    pub(crate) fn stratum(&self, stratum: Stratum) -> Color32 {
        match stratum {
            Stratum::Easy => self.pick(0x5CB99B, 0x278D73),
            Stratum::Medium => self.pick(0xD4BE52, 0xA18308),
            Stratum::Hard => self.pick(0xF34E6C, 0xC01244),
        }
    }

    /// The colour of a tag; its code says the same.
    pub(crate) fn tag(&self, tag: Tag) -> Color32 {
        match tag {
            Tag::F1 => self.pick(0xEC7859, 0xAA4429),
            Tag::F2 => self.pick(0xCE81E5, 0x9843B1),
            Tag::F3 => self.pick(0xF3C530, 0xA2790D),
            Tag::F4 => self.pick(0x3BC4E0, 0x087E9B),
            Tag::Clean => self.pick(0x5EDB81, 0x0E862C),
            Tag::Unsure => self.dim,
        }
    }

    /// The colours of the curves, by name.
    pub(crate) fn curve(&self, name: &str) -> Color32 {
        match name {
            "total" => self.text,
            "majpe" => self.pick(0xA6ECF4, 0x095258),
            "iou 0" => self.pick(0xA0BE66, 0x637D21),
            "iou 1" => rgb(0x5D7BF1),
            name => self.hue(TermId::of(name).map_or(Hue::Rose, |term| term.hue)),
        }
    }

    /// The colour of what a group of terms contributes: that of its first.
    pub(crate) fn group(&self, group: TermGroup) -> Color32 {
        self.hue(group.terms().next().map_or(Hue::Rose, |term| term.hue))
    }

    /// The shade of a colour that a term of the loss has.
    pub(crate) fn hue(&self, hue: Hue) -> Color32 {
        match hue {
            Hue::Blue => self.pick(0x89C5F7, 0x1C5C8C),
            Hue::Orange => self.pick(0xFCBA89, 0x945829),
            Hue::Violet => self.pick(0xB49CE1, 0x563B85),
            Hue::Green => self.pick(0x93E4A4, 0x1D6835),
            Hue::Amber => self.pick(0xF0E07F, 0x8A8419),
            Hue::Red => self.pick(0xEB9191, 0x963538),
            Hue::Rose => self.pick(0xF2B0D5, 0xB4608A),
            Hue::Teal => self.pick(0x6BCACA, 0x208182),
            Hue::Orchid => self.pick(0xC46BC4, 0x861A86),
            Hue::Slate => self.pick(0xAEB6C6, 0x4C566B),
        }
    }
}

/// Numbers: tabular figures.
pub(crate) fn mono(size: f32) -> FontId {
    FontId::new(size, FontFamily::Monospace)
}

/// Text that names a pane.
pub(crate) fn strong(size: f32) -> FontId {
    FontId::new(size, FontFamily::Name("semibold".into()))
}

/// Loads the fonts and sets both themes.
pub(crate) fn install(ctx: &egui::Context) {
    ctx.set_fonts(fonts());
    for (theme, tokens) in [(egui::Theme::Dark, DARK), (egui::Theme::Light, LIGHT)] {
        ctx.style_mut_of(theme, |style| {
            style.visuals = visuals(&tokens);
            style.text_styles = [
                (TextStyle::Body, FontId::new(BODY, FontFamily::Proportional)),
                (TextStyle::Button, FontId::new(BODY, FontFamily::Proportional)),
                (TextStyle::Small, FontId::new(CAPTION, FontFamily::Proportional)),
                (TextStyle::Heading, strong(TITLE)),
                (TextStyle::Monospace, mono(12.0)),
            ]
            .into();
            let space = &mut style.spacing;
            space.item_spacing = egui::vec2(2.0 * GRID, GRID);
            space.button_padding = egui::vec2(2.0 * GRID, 3.0);
            space.interact_size = egui::vec2(40.0, 22.0);
            space.slider_width = 120.0;
            space.combo_width = 96.0;
            space.menu_margin = Margin::same(6);
            space.tooltip_width = 380.0;
            space.scroll = egui::style::ScrollStyle { bar_width: 8.0, ..egui::style::ScrollStyle::thin() };
            style.interaction.tooltip_delay = 0.4;
            style.animation_time = 0.0;
        });
    }
}

/// Applies the chosen theme.
pub(crate) fn apply(ctx: &egui::Context, choice: ThemeChoice) {
    ctx.set_theme(match choice {
        ThemeChoice::Dark => egui::ThemePreference::Dark,
        ThemeChoice::Light => egui::ThemePreference::Light,
        ThemeChoice::System => egui::ThemePreference::System,
    });
}

fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let files: [(&str, &'static [u8]); 3] = [
        ("Inter", include_bytes!("../../assets/fonts/Inter-Regular.ttf")),
        ("Inter semibold", include_bytes!("../../assets/fonts/Inter-SemiBold.ttf")),
        ("JetBrains Mono", include_bytes!("../../assets/fonts/JetBrainsMono-Regular.ttf")),
    ];
    for (name, bytes) in files {
        fonts.font_data.insert(name.into(), Arc::new(FontData::from_static(bytes)));
    }
    let fallback = fonts.families.get(&FontFamily::Proportional).cloned().unwrap_or_default();
    let family = |first: &[&str]| first.iter().map(ToString::to_string).chain(fallback.iter().cloned()).collect();
    fonts.families.insert(FontFamily::Proportional, family(&["Inter", "JetBrains Mono"]));
    fonts.families.insert(FontFamily::Monospace, family(&["JetBrains Mono", "Inter"]));
    fonts.families.insert(FontFamily::Name("semibold".into()), family(&["Inter semibold", "JetBrains Mono"]));
    fonts
}

fn visuals(t: &Tokens) -> Visuals {
    let mut v = if t.dark { Visuals::dark() } else { Visuals::light() };
    let round = CornerRadius::same(3);
    v.override_text_color = None;
    v.panel_fill = t.panel;
    v.window_fill = t.panel;
    v.extreme_bg_color = t.canvas;
    v.faint_bg_color = t.raised;
    v.code_bg_color = t.raised;
    v.window_stroke = Stroke::new(1.0, t.stroke);
    v.window_corner_radius = CornerRadius::same(6);
    v.menu_corner_radius = CornerRadius::same(4);
    v.hyperlink_color = t.accent;
    v.warn_fg_color = t.warn;
    v.error_fg_color = t.bad;
    v.selection.bg_fill = t.accent.gamma_multiply(if t.dark { 0.35 } else { 0.25 });
    v.selection.stroke = Stroke::new(1.0, t.text);
    v.slider_trailing_fill = true;
    v.weak_text_color = Some(t.dim);
    v.popup_shadow.blur = 8;
    v.window_shadow.blur = 12;
    let w = &mut v.widgets;
    for (state, fill, stroke, text) in [
        (&mut w.noninteractive, t.panel, t.stroke, t.text),
        (&mut w.inactive, t.raised, t.stroke, t.text),
        (&mut w.hovered, t.stroke, t.dim, t.text),
        (&mut w.active, t.stroke, t.accent, t.text),
        (&mut w.open, t.raised, t.stroke, t.text),
    ] {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, stroke);
        state.fg_stroke = Stroke::new(1.0, text);
        state.corner_radius = round;
        state.expansion = 0.0;
    }
    // The track of a slider and the box of a check mark must be seen against the panel.
    w.inactive.bg_fill = t.stroke;
    v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mhp::TERMS;

    fn linear(color: Color32) -> [f64; 3] {
        let of = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        [color.r(), color.g(), color.b()].map(of)
    }

    /// As WCAG 2 has it: 1 to 21.
    fn contrast(a: Color32, b: Color32) -> f64 {
        let light = |color| {
            let [r, g, b] = linear(color);
            0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
        };
        let (a, b) = (light(a), light(b));
        a.max(b) / a.min(b)
    }

    /// Lightness and two axes of colour in which equal distances look about equal (Ottosson 2020).
    fn oklab(color: Color32) -> [f64; 3] {
        let [r, g, b] = linear(color);
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        [
            0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
            0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
        ]
    }

    fn distance(a: Color32, b: Color32) -> f64 {
        oklab(a).iter().zip(oklab(b)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    type Role = (&'static str, Color32);

    /// Roles that stand in one picture, and how far apart they are at least.
    fn pictures(t: &Tokens) -> Vec<(Vec<Role>, f64)> {
        let bodies = [
            ("left", t.left),
            ("right", t.right),
            ("selected", t.selected),
            ("truth", t.truth),
            ("pin", t.pin),
            ("middle", t.dim),
        ];
        let pulls = TermGroup::ALL.map(|group| (group.terms().next().map_or("", |term| term.key), t.group(group)));
        let people = ["first", "second", "third", "fourth", "fifth", "sixth"];
        let people = people.into_iter().enumerate().map(|(identity, name)| (name, t.person(identity)));
        let beside = [("selected", t.selected), ("truth", t.truth)];
        let terms = TERMS.iter().filter(|term| term.key != "dummy").map(|term| (term.key, t.curve(term.key)));
        let curves = ["total", "iou 0", "iou 1", "majpe"].map(|key| (key, t.curve(key)));
        let tags = Tag::ALL.map(|tag| (tag.code(), t.tag(tag)));
        let strata = [Stratum::Easy, Stratum::Medium, Stratum::Hard].map(|s| (s.word(), t.stratum(s)));
        let states = [("ok", t.ok), ("warn", t.warn), ("bad", t.bad), ("accent", t.accent)];
        vec![
            (bodies.to_vec(), 0.12),
            // Descent directions are arrows on the limbs.
            (bodies.into_iter().chain(pulls).collect(), 0.075),
            (people.chain(beside).collect(), 0.07),
            (terms.chain(curves).collect(), 0.06),
            (tags.to_vec(), 0.09),
            (strata.to_vec(), 0.14),
            (states.to_vec(), 0.12),
        ]
    }

    #[test]
    fn every_role_is_seen_on_every_ground_and_told_from_those_beside_it() {
        for t in [DARK, LIGHT] {
            let pictures = pictures(&t);
            for &(name, color) in pictures.iter().flat_map(|(roles, _)| roles) {
                for ground in [t.canvas, t.panel, t.raised] {
                    let seen = contrast(color, ground);
                    assert!(seen >= 3.0, "{name} in the theme dark={}: {seen:.2}", t.dark);
                }
            }
            for (roles, least) in &pictures {
                for (i, a) in roles.iter().enumerate() {
                    for b in &roles[i + 1..] {
                        let apart = distance(a.1, b.1);
                        assert!(apart >= *least, "{} and {} in the theme dark={}: {apart:.3}", a.0, b.0, t.dark);
                    }
                }
            }
        }
    }

    #[test]
    fn no_two_roles_share_a_colour() {
        for t in [DARK, LIGHT] {
            // What has no tag and what is the middle of a body is grey in both.
            let mut all: Vec<Role> = pictures(&t).into_iter().flat_map(|(roles, _)| roles).collect();
            // What is selected, the truth and the terms are the same beside others.
            all.sort_by_key(|role| role.0);
            all.dedup();
            for (i, a) in all.iter().enumerate() {
                for b in all[i + 1..].iter().filter(|b| (a.1, b.1) != (t.dim, t.dim)) {
                    let apart = distance(a.1, b.1);
                    assert!(apart >= 0.02, "{} and {} in the theme dark={}: {apart:.3}", a.0, b.0, t.dark);
                }
            }
        }
    }

    #[test]
    fn masks_are_told_from_each_other_and_from_the_body_over_them() {
        let roles = [MASK_BOTH, MASK_ORI, MASK_SIM, DARK.left, DARK.right, DARK.selected, DARK.truth];
        for (i, &a) in roles.iter().enumerate() {
            assert!(contrast(a, MASK_GROUND) >= 3.0);
            for &b in &roles[i + 1..] {
                assert!(distance(a, b) >= 0.09, "{a:?} {b:?}: {:.3}", distance(a, b));
            }
        }
    }
}
