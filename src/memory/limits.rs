//! How much memory a run may take: what the machine and its control groups allow, and sizes as texts.

use crate::error::{Error, Result};
use std::path::Path;

/// Units of sizes by their texts, in bytes; the first of each size is used for output.
const UNITS: [(&str, u64); 9] = [
    ("TiB", 1 << 40),
    ("GiB", 1 << 30),
    ("MiB", 1 << 20),
    ("KiB", 1 << 10),
    ("TB", 1_000_000_000_000),
    ("GB", 1_000_000_000),
    ("MB", 1_000_000),
    ("kB", 1_000),
    ("B", 1),
];

/// Bytes of memory that this process may take: those of the machine or, where it is less, the limit of its
/// control group (version 1 or 2). `None` where the system does not tell (it does on Linux).
pub fn available_memory() -> Option<u64> {
    let machine = || {
        let text = std::fs::read_to_string("/proc/meminfo").ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
    };
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    machine().into_iter().chain(group_limits(Path::new("/sys/fs/cgroup"), &groups)).min()
}

/// Fraction of the available memory that is taken by default.
#[cfg(feature = "io")]
const DEFAULT_FRACTION: f64 = 0.75;
/// Memory where the system does not tell how much there is.
#[cfg(feature = "io")]
const DEFAULT_MEMORY: u64 = 4 << 30;

/// The bytes to keep to: those of the option `memory`, or a fraction of what is available where it is 0.
#[cfg(feature = "io")]
pub(crate) fn memory_budget(option: u64) -> u64 {
    match option {
        0 => available_memory().map_or(DEFAULT_MEMORY, |bytes| (bytes as f64 * DEFAULT_FRACTION) as u64),
        bytes => bytes,
    }
}

/// The limits of the control groups that `/proc/self/cgroup` lists, and of the groups around them. A
/// container often sees its own group as the root.
fn group_limits(root: &Path, groups: &str) -> Vec<u64> {
    let mut limits = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(group)) = (parts.next(), parts.next()) else { continue };
        let (base, file) = match controllers {
            "" => (root.to_owned(), "memory.max"),
            list if list.split(',').any(|name| name == "memory") => {
                (root.join("memory"), "memory.limit_in_bytes")
            }
            _ => continue,
        };
        let own = Path::new(group.trim_start_matches('/'));
        for group in own.ancestors() {
            let text = std::fs::read_to_string(base.join(group).join(file)).unwrap_or_default();
            // "max", no number, is no limit.
            limits.extend(text.trim().parse::<u64>().ok());
        }
    }
    limits
}

/// The bytes that a text like `8GiB`, `1.5 GB` or `500000` stands for.
///
/// # Errors
/// Another text.
///
/// # Examples
/// ```
/// assert_eq!(skep::parse_bytes("8GiB")?, 8 << 30);
/// assert_eq!(skep::parse_bytes("1.5 MB")?, 1_500_000);
/// assert!(skep::parse_bytes("8 parsecs").is_err());
/// # Ok::<(), skep::Error>(())
/// ```
pub fn parse_bytes(text: &str) -> Result<u64> {
    let expected = "a number with a unit, such as 8GiB, 500MiB, 8GB, or a number of bytes";
    let error = || Error::argument("memory", format!("`{text}`"), expected);
    let trimmed = text.trim();
    let digits = trimmed.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(trimmed.len());
    let (number, unit) = trimmed.split_at(digits);
    let number: f64 = number.parse().map_err(|_| error())?;
    let unit = unit.trim();
    let bytes = match UNITS.iter().find(|(name, _)| name.eq_ignore_ascii_case(unit)) {
        Some((_, bytes)) => *bytes,
        None if unit.is_empty() => 1,
        None => return Err(error()),
    };
    let total = (number * bytes as f64).round();
    if total < 2f64.powi(53) { Ok(total as u64) } else { Err(error()) }
}

/// A number of bytes as people read it, rounded up to three digits, such as `2.35 GiB`.
pub fn format_bytes(bytes: u64) -> String {
    let (unit, size) = UNITS[..4].iter().find(|(_, size)| bytes >= *size).unwrap_or(&("B", 1));
    let value = bytes as f64 / *size as f64;
    let decimals = if *size == 1 || value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    let scale = 10f64.powi(decimals);
    format!("{:.*} {unit}", decimals as usize, (value * scale).ceil() / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_written_as_people_do() {
        let texts = [("8GiB", 8 << 30), ("0.5 gib", 1 << 29), ("500000", 500_000), ("3kB", 3000), ("7B", 7)];
        for (text, bytes) in texts {
            assert_eq!(parse_bytes(text), Ok(bytes), "{text}");
        }
        for wrong in ["", "GiB", "-1GiB", "1e3", "8 GiBs", "1.2.3MB", "9999999TiB"] {
            let error = parse_bytes(wrong).unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains("8GiB"), "{error}");
        }
        assert_eq!(format_bytes(8 << 30), "8.00 GiB");
        assert_eq!(format_bytes((1 << 30) + 1), "1.01 GiB", "a need is never understated");
        assert_eq!(format_bytes(999), "999 B");
        assert_eq!(format_bytes(150 << 20), "150 MiB");
    }

    #[test]
    fn the_limits_of_control_groups_of_both_versions_and_of_their_parents_count() {
        let root = std::env::temp_dir().join(format!("skep-cgroup-{}", std::process::id()));
        let write = |path: &str, text: &str| {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        write("memory.max", "max\n");
        write("a/memory.max", "3000\n");
        write("a/b/memory.max", "max\n");
        write("memory/c/memory.limit_in_bytes", "2000\n");
        assert_eq!(group_limits(&root, "0::/a/b\n"), [3000]);
        assert_eq!(group_limits(&root, "5:cpu,memory:/c\n3:cpu:/d\n"), [2000]);
        assert!(group_limits(&root, "0::/not/there\nnonsense\n").is_empty());
        std::fs::remove_dir_all(&root).unwrap();
    }

    #[test]
    fn the_machine_tells_its_memory() {
        if cfg!(target_os = "linux") {
            assert!(available_memory().unwrap() > 1 << 26);
        }
    }
}
