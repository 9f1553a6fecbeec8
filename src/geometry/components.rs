//! Connected components of the pixels of an image.

use super::grid::Grid;

/// Calls `visit` with the pixels of every 4-connected component of the members, in the order of their first
/// pixels. Neighboring members are connected where `is_connected` says so, which must be symmetric.
pub(crate) fn for_each_component(
    grid: Grid,
    is_member: impl Fn(usize) -> bool,
    is_connected: impl Fn(usize, usize) -> bool,
    mut visit: impl FnMut(&[usize]),
) {
    let mut is_traced = vec![false; grid.pixels()];
    let mut component = Vec::new();
    for first in 0..grid.pixels() {
        if is_traced[first] || !is_member(first) {
            continue;
        }
        is_traced[first] = true;
        component.clear();
        component.push(first);
        let mut next = 0;
        while next < component.len() {
            let pixel = component[next];
            for other in grid.four_neighbors(pixel).into_iter().flatten() {
                if !is_traced[other] && is_member(other) && is_connected(pixel, other) {
                    is_traced[other] = true;
                    component.push(other);
                }
            }
            next += 1;
        }
        visit(&component);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The components of the pixels marked other than with a dot, as sorted lists; equal marks are connected.
    fn components(rows: &[&str]) -> Vec<Vec<usize>> {
        let marks: Vec<u8> = rows.iter().flat_map(|row| row.bytes()).collect();
        let grid = Grid { width: rows[0].len(), height: rows.len() };
        let mut found = Vec::new();
        let visit = |pixels: &[usize]| {
            let mut pixels = pixels.to_vec();
            pixels.sort_unstable();
            found.push(pixels);
        };
        for_each_component(grid, |pixel| marks[pixel] != b'.', |a, b| marks[a] == marks[b], visit);
        found
    }

    #[test]
    fn components_end_at_other_pixels_and_where_neighbors_are_not_connected() {
        let found = components(&["aa.b", ".abb", "a..c"]);
        assert_eq!(found, [vec![0, 1, 5], vec![3, 6, 7], vec![8], vec![11]]);
        assert!(components(&["...", "..."]).is_empty());
    }
}
