//! What memory the machine can still give.

use std::fs;
use std::path::Path;

/// What is not asked for: so little is taken to be there, and asking takes as long as reading a small file.
pub const NOT_ASKED_BYTES: u64 = 256 << 20;

/// Memory that can be had without swapping, in bytes: what the system has left, or the process's group of processes if
/// that is less (cgroup version 2, and 1). `None` where the system does not say.
pub fn available_bytes() -> Option<u64> {
    let system = kib_field(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:");
    [system, group_bytes()].into_iter().flatten().min()
}

/// A line `Name:   123 kB` of a /proc file, in bytes.
pub fn kib_field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// What is left of the least limit of the groups that this process is in; in a container, of the one at the root.
fn group_bytes() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let left = |(folder, limit, usage, statistics, inactive): (String, &str, &str, &str, &str)| {
        let folder = Path::new(&folder);
        let number = |name: &str| fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
        // Files that are cached and not in use count as used, but make way.
        let statistics = fs::read_to_string(folder.join(statistics)).unwrap_or_default();
        let cached = statistics.lines().find_map(|line| line.strip_prefix(inactive)?.trim().parse::<u64>().ok());
        Some(number(limit)?.saturating_sub(number(usage)?.saturating_sub(cached.unwrap_or(0))))
    };
    group_folders(&groups).into_iter().filter_map(left).min()
}

type GroupFiles = (String, &'static str, &'static str, &'static str, &'static str);

/// Folders that tell of the memory of a group, its ancestors' included, with the names of the files in them.
fn group_folders(groups: &str) -> Vec<GroupFiles> {
    let mut folders = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(path)) = (parts.next(), parts.next(), parts.next()) else { continue };
        let is_version_1 = controllers.split(',').any(|controller| controller == "memory");
        if !is_version_1 && !controllers.is_empty() {
            continue;
        }
        for group in Path::new(path).ancestors() {
            let group = group.to_string_lossy();
            let group = group.trim_end_matches('/');
            folders.push(if is_version_1 {
                let folder = format!("/sys/fs/cgroup/memory{group}");
                (folder, "memory.limit_in_bytes", "memory.usage_in_bytes", "memory.stat", "total_inactive_file ")
            } else {
                (format!("/sys/fs/cgroup{group}"), "memory.max", "memory.current", "memory.stat", "inactive_file ")
            });
        }
    }
    folders
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_proc_files_are_read_in_bytes() {
        let text = "MemTotal:  100 kB\nMemAvailable:    24 kB\nOdd: 1\n";
        assert_eq!(kib_field(text, "MemAvailable:"), Some(24 * 1024));
        assert_eq!(kib_field(text, "Odd:"), None);
        assert_eq!(kib_field(text, "VmHWM:"), None);
    }

    #[test]
    fn groups_are_looked_for_up_to_the_root_in_both_versions() {
        let folders = |text| group_folders(text).into_iter().map(|files| files.0).collect::<Vec<_>>();
        assert_eq!(folders("0::/a/b\n"), ["/sys/fs/cgroup/a/b", "/sys/fs/cgroup/a", "/sys/fs/cgroup"]);
        let version_1 = "9:cpu,cpuacct:/x\n4:memory:/docker/1\n";
        assert_eq!(
            folders(version_1),
            ["/sys/fs/cgroup/memory/docker/1", "/sys/fs/cgroup/memory/docker", "/sys/fs/cgroup/memory"]
        );
        assert!(folders("junk\n1:name=systemd:/\n").is_empty());
    }
}
