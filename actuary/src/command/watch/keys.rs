//! What is pressed while a board is watched.

use std::thread;

use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use tokio::sync::mpsc;

/// What a key is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Ends the board.
    End,
    /// The terminal has another size.
    Resized,
    /// Moves by so many lines.
    Moved(isize),
}

/// Lines of a page.
const PAGE: isize = 10;

/// Keys, as they are pressed; the thread that reads them ends with the process, or where there is no terminal to read from.
pub fn keys() -> mpsc::Receiver<Key> {
    let (sender, receiver) = mpsc::channel(16);
    thread::spawn(move || {
        while let Ok(event) = event::read() {
            if let Some(key) = meaning(&event)
                && sender.blocking_send(key).is_err()
            {
                break;
            }
        }
    });
    receiver
}

fn meaning(event: &Event) -> Option<Key> {
    match event {
        Event::Resize(..) => Some(Key::Resized),
        Event::Key(KeyEvent { code, modifiers, kind: KeyEventKind::Press | KeyEventKind::Repeat, .. }) => match code {
            KeyCode::Char('c') if modifiers.contains(KeyModifiers::CONTROL) => Some(Key::End),
            KeyCode::Char('q') | KeyCode::Esc => Some(Key::End),
            KeyCode::Down | KeyCode::Char('j') => Some(Key::Moved(1)),
            KeyCode::Up | KeyCode::Char('k') => Some(Key::Moved(-1)),
            KeyCode::PageDown | KeyCode::Char(' ') => Some(Key::Moved(PAGE)),
            KeyCode::PageUp => Some(Key::Moved(-PAGE)),
            _ => None,
        },
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_ends_with_q_or_control_c_and_other_keys_do_not_end_it() {
        let pressed = |code, modifiers| meaning(&Event::Key(KeyEvent::new(code, modifiers)));
        assert_eq!(pressed(KeyCode::Char('q'), KeyModifiers::NONE), Some(Key::End));
        assert_eq!(pressed(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Key::End));
        assert_eq!(pressed(KeyCode::Char('c'), KeyModifiers::NONE), None);
        assert_eq!(pressed(KeyCode::Down, KeyModifiers::NONE), Some(Key::Moved(1)));
    }
}
