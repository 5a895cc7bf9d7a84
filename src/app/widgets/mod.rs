//! Small pieces that several panes use.

mod chip;
mod colorbar;

pub(super) use chip::{Named, chip, icon_button, iou_color, value_row};
pub(super) use colorbar::{ColorBar, colorbar, tick};
