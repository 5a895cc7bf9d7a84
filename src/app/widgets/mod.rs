//! Small pieces that several panes use.

mod chip;
mod colorbar;

pub(super) use chip::{chip, iou_color, icon_button, value_row};
pub(super) use colorbar::{ColorBar, colorbar};
