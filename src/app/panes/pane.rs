//! What the window knows of a pane before it is drawn, and what panes remember between passes.

use super::{PANES, Shared};
use crate::app::commands::Shortcut;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Icon;
use crate::session::Session;
use egui::Ui;
use serde::de::{self, Deserialize, Deserializer, EnumAccess, VariantAccess as _, Visitor};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value};
use std::any::Any;
use std::borrow::Cow;
use std::fmt;

/// A function that draws a part of a pane.
type Draw = fn(&mut Ui, &mut Shared<'_>, &mut PaneStates);

/// A pane, as its file describes it.
pub struct Pane {
    /// Its name in stored layouts and session files: never changed, and never given to another pane.
    pub(super) key: &'static str,
    /// The title of its tab; `Show TITLE` brings it to the front.
    pub(super) title: &'static str,
    /// What stands for it where its title has no room.
    pub(super) icon: Icon,
    /// What it shows, as the end of a sentence.
    pub(super) help: &'static str,
    /// Where it is in the default layout.
    pub(super) dock: Dock,
    /// The keys that bring it to the front.
    pub(super) keys: &'static [Shortcut],
    /// Room between its edges and what it draws, points.
    pub(super) margin: i8,
    /// Makes what it remembers: [`PaneStates::prepare`] of its own type, `()` for nothing.
    pub(super) state: fn(&mut PaneStates),
    /// What it says where it has nothing to draw.
    pub(super) blank: fn(&Session) -> Option<Blank>,
    /// The line above what it draws.
    pub(super) toolbar: Option<Draw>,
    /// What it draws.
    pub(super) ui: Draw,
}

/// What a pane says where it has nothing to draw: that, and what would fill it.
pub(crate) struct Blank {
    title: &'static str,
    how: Cow<'static, str>,
}

impl Blank {
    /// A title, and how to fill the pane.
    pub(super) fn new(title: &'static str, how: impl Into<Cow<'static, str>>) -> Self {
        Self { title, how: how.into() }
    }

    /// Says it in the middle of what is left of `ui`.
    pub(super) fn show(&self, ui: &mut Ui) {
        let Self { title, how } = self;
        let tokens = Tokens::of(ui);
        let area = ui.available_rect_before_wrap().shrink(16.0);
        let mut text = egui::text::LayoutJob::default();
        let format = |font, color| egui::TextFormat { font_id: font, color, ..Default::default() };
        text.append(title, 0.0, format(theme::strong(theme::BODY), tokens.text));
        if !how.is_empty() {
            text.append(&format!("\n{how}"), 0.0, format(egui::FontId::proportional(theme::CAPTION), tokens.dim));
        }
        text.halign = egui::Align::Center;
        text.wrap.max_width = area.width().clamp(60.0, 420.0);
        let galley = ui.painter().layout_job(text);
        let top = (area.center().y - galley.size().y / 2.0).max(area.top());
        let rect =
            egui::Rect::from_min_size(egui::pos2(area.left(), top), egui::vec2(area.width().max(1.0), galley.size().y));
        let response = ui.allocate_rect(rect, egui::Sense::hover());
        let spoken = format!("{title}. {how}");
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &spoken));
        ui.painter().with_clip_rect(ui.clip_rect()).galley(egui::pos2(area.center().x, top), galley, tokens.text);
    }
}

/// Where a pane is in the default layout. Panes of one place are tabs, in the order of the list of panes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dock {
    /// The upper part of the column at the left edge.
    LeftTop,
    /// The lower part of the column at the left edge.
    LeftBottom,
    /// The middle: most of the window.
    Centre,
    /// Below the middle.
    Bottom,
    /// There too, with more height while it is in front: lists and tables beside maps that matter as much.
    BottomHigh,
    /// There too, with still more: pictures over two axes.
    BottomTall,
    /// The upper part of the column at the right edge.
    RightTop,
    /// The lower part of the column at the right edge.
    RightBottom,
}

impl Dock {
    /// Whether panes of both are tabs of one place.
    pub(in crate::app) fn is_beside(self, other: Self) -> bool {
        let place = |dock| match dock {
            Self::BottomHigh | Self::BottomTall => Self::Bottom,
            dock => dock,
        };
        place(self) == place(other)
    }
}

impl Pane {
    /// Every pane, in the order of the menu.
    pub fn all() -> &'static [&'static Self] {
        PANES
    }

    /// The pane with this title, in capitals or not.
    pub fn called(title: &str) -> Option<&'static Self> {
        PANES.iter().find(|pane| pane.title.eq_ignore_ascii_case(title)).copied()
    }

    /// The title of its tab.
    pub fn title(&self) -> &'static str {
        self.title
    }

    /// What stands for it where its title has no room.
    pub(in crate::app) fn icon(&self) -> Icon {
        self.icon
    }

    /// Where it is in the default layout.
    pub(in crate::app) fn dock(&self) -> Dock {
        self.dock
    }

    /// The keys that bring it to the front.
    pub(in crate::app) fn keys(&self) -> &'static [Shortcut] {
        self.keys
    }

    /// What it shows, as the end of a sentence.
    pub(in crate::app) fn help(&self) -> &'static str {
        self.help
    }

    /// Draws it in what is left of `ui`, whose colour is `fill`.
    pub(in crate::app) fn show(
        &self,
        ui: &mut Ui,
        fill: egui::Color32,
        shared: &mut Shared<'_>,
        states: &mut PaneStates,
    ) {
        egui::Frame::new().fill(fill).inner_margin(self.margin).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            if let Some(blank) = (self.blank)(shared.session) {
                return blank.show(ui);
            }
            shared.pane = ui.max_rect();
            if let Some(toolbar) = self.toolbar {
                toolbar(ui, shared, states);
            }
            (self.ui)(ui, shared, states);
        });
    }
}

impl PartialEq for Pane {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Eq for Pane {}

impl fmt::Debug for Pane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.key)
    }
}

/// As the variant of an enumeration: layouts were stored so from the beginning. Neither RON nor JSON writes its index.
impl Serialize for Pane {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_unit_variant("PaneKind", 0, self.key)
    }
}

impl<'de> Deserialize<'de> for &'static Pane {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("PaneKind", &[], VariantVisitor)
    }
}

/// Reads a pane's key where a variant is expected.
struct VariantVisitor;

impl<'de> Visitor<'de> for VariantVisitor {
    type Value = &'static Pane;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a pane")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Self::Value, A::Error> {
        let (KeyOf(pane), rest) = data.variant()?;
        rest.unit_variant()?;
        Ok(pane)
    }
}

/// A pane, read from its key.
struct KeyOf(&'static Pane);

impl<'de> Deserialize<'de> for KeyOf {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeyVisitor;
        impl Visitor<'_> for KeyVisitor {
            type Value = KeyOf;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the key of a pane")
            }

            fn visit_str<E: de::Error>(self, key: &str) -> Result<KeyOf, E> {
                let known = PANES.iter().find(|pane| pane.key == key);
                known.map(|pane| KeyOf(pane)).ok_or_else(|| E::custom(format_args!("no pane has the key {key}")))
            }
        }
        deserializer.deserialize_identifier(KeyVisitor)
    }
}

/// What a pane remembers between passes: textures, zoom, camera. None of it is a user's work.
pub(crate) trait PaneState: Any {
    /// Shows everything again, as at first.
    fn reset_view(&mut self) {}

    /// Fills the picture with the person, or with what is selected.
    fn focus(&mut self, _session: &Session) {}

    /// Shows all there is, and keeps whatever else was set.
    fn show_all(&mut self) {}

    /// One step back from what was singled out; false where nothing was.
    fn back(&mut self) -> bool {
        false
    }

    /// Whether all there is is shown.
    fn shows_all(&self) -> bool {
        true
    }

    /// Whether something is computed for it that will be drawn.
    fn is_working(&self) -> bool {
        false
    }

    /// The name under which a session file keeps something of it.
    fn stored_as(&self) -> Option<&'static str> {
        None
    }

    /// What a session file keeps.
    ///
    /// # Errors
    /// Where it cannot be written as JSON.
    fn stored(&self) -> serde_json::Result<Value> {
        Ok(Value::Null)
    }

    /// Puts back what a session file kept; `null` where it kept nothing.
    ///
    /// # Errors
    /// Where the file says something else.
    fn restore(&mut self, _stored: Value, _session: &Session) -> serde_json::Result<()> {
        Ok(())
    }
}

/// Panes that remember nothing.
impl PaneState for () {}

/// What the panes remember, one value a type: panes that name the same type share it.
pub(crate) struct PaneStates(Vec<Box<dyn PaneState>>);

impl Default for PaneStates {
    fn default() -> Self {
        let mut states = Self(Vec::new());
        for pane in PANES {
            (pane.state)(&mut states);
        }
        states
    }
}

impl PaneStates {
    /// The value of a type, as it is at first where it was not asked for before.
    pub(super) fn of<T: PaneState + Default>(&mut self) -> &mut T {
        let known = self.0.iter().position(|state| (&**state as &dyn Any).is::<T>());
        let at = known.unwrap_or_else(|| {
            self.0.push(Box::new(T::default()));
            self.0.len() - 1
        });
        let state: &mut dyn Any = &mut *self.0[at];
        let Some(state) = state.downcast_mut() else { unreachable!("it was found by its type") };
        state
    }

    /// Makes the value of a type.
    pub(super) fn prepare<T: PaneState + Default>(&mut self) {
        self.of::<T>();
    }

    /// Shows everything again, as at first.
    pub(in crate::app) fn reset_views(&mut self) {
        self.0.iter_mut().for_each(|state| state.reset_view());
    }

    /// Zooms to the person, or to what is selected.
    pub(in crate::app) fn focus(&mut self, session: &Session) {
        self.0.iter_mut().for_each(|state| state.focus(session));
    }

    /// One step back from what was singled out in a pane; false where nothing was.
    pub(in crate::app) fn back(&mut self) -> bool {
        self.0.iter_mut().any(|state| state.back())
    }

    /// Whether something is computed for a pane that will be drawn.
    pub(in crate::app) fn are_working(&self) -> bool {
        self.0.iter().any(|state| state.is_working())
    }

    /// The person, or where that is shown already, all there is.
    pub(in crate::app) fn toggle_focus(&mut self, session: &Session) {
        if self.0.iter().all(|state| state.shows_all()) {
            self.focus(session);
        } else {
            self.0.iter_mut().for_each(|state| state.show_all());
        }
    }

    /// What a session file keeps of the panes.
    ///
    /// # Errors
    /// Where it cannot be written as JSON.
    pub(in crate::app) fn stored(&self) -> serde_json::Result<Map<String, Value>> {
        let kept = self.0.iter().filter_map(|state| Some((state.stored_as()?, state)));
        kept.map(|(name, state)| Ok((name.to_owned(), state.stored()?))).collect()
    }

    /// Puts back what a session file kept.
    ///
    /// # Errors
    /// Where the file says something else.
    pub(in crate::app) fn restore(
        &mut self,
        mut stored: Map<String, Value>,
        session: &Session,
    ) -> serde_json::Result<()> {
        for state in &mut self.0 {
            if let Some(name) = state.stored_as() {
                state.restore(stored.remove(name).unwrap_or_default(), session)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::widgets::icon_extent;

    /// Every pane has an icon of its own, which fills its square and stays in it.
    #[test]
    fn panes_are_told_apart_by_their_icons() {
        for (k, pane) in PANES.iter().enumerate() {
            assert!(PANES[k + 1..].iter().all(|other| other.icon != pane.icon), "{}", pane.key);
            let extent = icon_extent(pane.icon);
            assert!(egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(16.0, 16.0)).contains_rect(extent));
            assert!(extent.width().max(extent.height()) >= 12.0, "{}: {extent:?}", pane.key);
        }
    }
}
