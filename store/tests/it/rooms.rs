//! The rooms of the SQL: `src/sql/mod.rs` lists them from the ground up.

use std::{fs, path::Path};

/// What the `use super::super::...` of a module names; rooms stand beside one another there.
fn used_of_other_rooms(module: &str) -> String {
    let statements = module.split("use super::super::").skip(1);
    statements.filter_map(|rest| rest.split_once(';')).map(|(statement, _)| statement).collect()
}

#[test]
fn a_room_uses_only_rooms_that_stand_before_it() {
    let sql = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/sql");
    let list = fs::read_to_string(sql.join("mod.rs")).unwrap();
    let rooms: Vec<&str> = list.lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';')).collect();
    assert!(rooms.len() > 10, "{rooms:?}");
    for (place, room) in rooms.iter().enumerate() {
        for file in fs::read_dir(sql.join(room)).unwrap() {
            let path = file.unwrap().path();
            let used = used_of_other_rooms(&fs::read_to_string(&path).unwrap());
            for later in &rooms[place..] {
                let names_it = used.match_indices(&format!("{later}::")).any(|(at, _)| {
                    !used[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_' || before == ':')
                });
                assert!(!names_it, "{} uses the room {later}", path.display());
            }
        }
    }
}
