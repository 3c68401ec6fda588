//! Where in the picture the sphere is seen, and what of it is at a place there.

use glam::DVec3;

use super::pen::{At, Frame};
use super::view::View;

/// Where the projection's plane lies in the picture.
pub(super) struct Viewport<'a> {
    pub(super) view: &'a View,
    /// The rectangle of the plane.
    pub(super) frame: Frame,
    /// Width of the panel.
    pub(super) panel: f64,
}

impl Viewport<'_> {
    /// Width and height of the map in pixels.
    pub(super) fn pixels(&self) -> (usize, usize) {
        (self.frame.width as usize, self.frame.height as usize)
    }

    /// Width of the panel.
    pub(super) fn width(&self) -> f64 {
        self.panel
    }

    /// Pixels of a unit of the plane, which in the middle is a radian.
    pub(super) fn scale(&self) -> f64 {
        self.frame.width / (2.0 * self.view.projection().half_extent().0)
    }

    /// Colatitude and longitude at a place on the map, counted from its corner.
    pub(super) fn sphere(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (a, b) = self.view.projection().half_extent();
        self.view.sphere((x / self.frame.width * 2.0 - 1.0) * a, (1.0 - y / self.frame.height * 2.0) * b)
    }

    /// Whether a place in the panel is on the map.
    pub(super) fn covers(&self, (x, y): At) -> bool {
        self.sphere(x - self.frame.left, y - self.frame.top).is_some()
    }

    /// Where a point of the plane is.
    pub(super) fn of_plane(&self, (u, v): (f64, f64)) -> At {
        let (a, b) = self.view.projection().half_extent();
        (
            self.frame.left + (u / a + 1.0) / 2.0 * self.frame.width,
            self.frame.top + (1.0 - v / b) / 2.0 * self.frame.height,
        )
    }

    /// Where points of the plane are.
    pub(super) fn all(&self, points: &[(f64, f64)]) -> Vec<At> {
        points.iter().map(|&point| self.of_plane(point)).collect()
    }

    /// Where a point of the sphere is seen, if it is.
    pub(super) fn pixel(&self, at: DVec3) -> Option<At> {
        Some(self.of_plane(self.view.plane(at)?))
    }
}
