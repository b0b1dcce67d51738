//! Tokens: `id.secret`. The id names a token everywhere; the secret is shown once and kept by nobody but its
//! owner. It has 256 random bits, so that its SHA-256 is all that need be stored: there is nothing to guess.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use subtle::ConstantTimeEq;

use crate::ContentHash;

/// A token's name: 16 lower-case hexadecimal digits. No secret.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct TokenId([u8; 8]);

/// What proves that a caller is who a token's id says. It is never printed but by [`Token::reveal`].
#[derive(Clone)]
pub struct Secret([u8; 32]);

/// The SHA-256 of a secret: what is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SecretHash(ContentHash);

/// What a caller shows.
#[derive(Debug, Clone)]
pub struct Token {
    /// Its name.
    pub id: TokenId,
    /// Its proof.
    pub secret: Secret,
}

/// A text that is no token. It never repeats the text: any part of it may be a secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidToken {
    /// Not two parts.
    #[error("a token must be an id and a secret with a dot between them")]
    Parts,
    /// The first part is no id.
    #[error("the id of a token must be 16 lower-case hexadecimal digits")]
    Id,
    /// The second part is no secret.
    #[error("the secret of a token must be 64 lower-case hexadecimal digits")]
    Secret,
}

impl Token {
    /// A new token out of random bytes, which must be used for nothing else.
    pub fn issue(random: [u8; 32]) -> Self {
        // A part of another hash than the stored one: it tells nothing about either.
        let name = ContentHash::of_parts([b"token id".as_slice(), random.as_slice()]);
        let mut id = [0; 8];
        id.copy_from_slice(&name.bytes()[..8]);
        Self { id: TokenId(id), secret: Secret(random) }
    }

    /// A token whose parts come one by one, as in HTTP Basic.
    pub fn from_parts(id: &str, secret: &str) -> Result<Self, InvalidToken> {
        Ok(Self { id: id.parse()?, secret: Secret(digits(secret).ok_or(InvalidToken::Secret)?) })
    }

    /// The text to be handed to the token's owner, once, and to nobody else.
    pub fn reveal(&self) -> String {
        format!("{}.{}", self.id, hex::encode(self.secret.0))
    }
}

impl FromStr for Token {
    type Err = InvalidToken;

    fn from_str(text: &str) -> Result<Self, InvalidToken> {
        let (id, secret) = text.split_once('.').ok_or(InvalidToken::Parts)?;
        Self::from_parts(id, secret)
    }
}

impl Secret {
    /// What is stored of it.
    pub fn hash(&self) -> SecretHash {
        SecretHash(ContentHash::of(&self.0))
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret")
    }
}

impl SecretHash {
    /// Whether it is the hash of this secret; how long that takes says nothing about either.
    pub fn matches(&self, secret: &Secret) -> bool {
        self.0.bytes().ct_eq(secret.hash().0.bytes()).into()
    }

    /// The 32 bytes.
    pub fn bytes(&self) -> &[u8; 32] {
        self.0.bytes()
    }
}

impl From<ContentHash> for SecretHash {
    fn from(hash: ContentHash) -> Self {
        Self(hash)
    }
}

impl fmt::Display for TokenId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex::encode(self.0))
    }
}

impl fmt::Debug for TokenId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TokenId({self})")
    }
}

impl FromStr for TokenId {
    type Err = InvalidToken;

    fn from_str(text: &str) -> Result<Self, InvalidToken> {
        digits(text).map(Self).ok_or(InvalidToken::Id)
    }
}

impl TryFrom<String> for TokenId {
    type Error = InvalidToken;

    fn try_from(text: String) -> Result<Self, InvalidToken> {
        text.parse()
    }
}

impl From<TokenId> for String {
    fn from(id: TokenId) -> String {
        id.to_string()
    }
}

/// The bytes of exactly `2 N` lower-case hexadecimal digits.
pub(crate) fn digits<const N: usize>(text: &str) -> Option<[u8; N]> {
    let lower = !text.bytes().any(|byte| byte.is_ascii_uppercase());
    hex::decode(text).ok().filter(|_| lower)?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_token_reads_back_and_its_hash_knows_its_secret_only(one in any::<[u8; 32]>(), other in any::<[u8; 32]>()) {
            let (token, stranger) = (Token::issue(one), Token::issue(other));
            let read: Token = token.reveal().parse().unwrap();
            prop_assert_eq!(read.id, token.id);
            prop_assert!(token.secret.hash().matches(&read.secret));
            prop_assert_eq!(token.secret.hash().matches(&stranger.secret), one == other);
            prop_assert_eq!(token.id.to_string().parse(), Ok(token.id));
        }

        #[test]
        fn nothing_but_reveal_prints_a_secret(random in any::<[u8; 32]>()) {
            let token = Token::issue(random);
            let text = token.reveal();
            let secret = text.split_once('.').unwrap().1;
            let printed = format!("{token:?} {token:#?} {} {:?}", token.id, token.secret.hash());
            for at in 0..secret.len() - 8 {
                prop_assert!(!printed.contains(&secret[at..at + 8]), "{}", printed);
            }
        }

        #[test]
        fn any_change_of_the_text_makes_another_token_or_none(
            random in any::<[u8; 32]>(), at in 0_usize..81, with in any::<char>(),
        ) {
            let token = Token::issue(random);
            let mut text: Vec<char> = token.reveal().chars().collect();
            prop_assume!(text[at] != with);
            text[at] = with;
            let changed: String = text.into_iter().collect();
            match changed.parse::<Token>() {
                Ok(read) => prop_assert!(read.id != token.id || !token.secret.hash().matches(&read.secret)),
                Err(InvalidToken::Parts) => prop_assert_eq!(at, 16),
                Err(InvalidToken::Id) => prop_assert!(at <= 16),
                Err(InvalidToken::Secret) => prop_assert!(at != 16),
            }
        }

        #[test]
        fn no_refusal_repeats_what_was_given(text in "[ -~]{6,100}") {
            if let Err(error) = text.parse::<Token>() {
                let said = format!("{error} {error:?}");
                prop_assert!(!said.contains(&text), "{}", said);
            }
        }
    }

    #[test]
    fn a_refusal_names_the_part_that_is_wrong() {
        let token = Token::issue([7; 32]).reveal();
        let (id, secret) = token.split_once('.').unwrap();
        let refused = |text: &str| text.parse::<Token>().unwrap_err();
        assert_eq!(refused(""), InvalidToken::Parts);
        assert_eq!(refused(secret), InvalidToken::Parts);
        assert_eq!(refused(&format!("{secret}.{id}")), InvalidToken::Id);
        assert_eq!(refused(&format!("{id}.{}", &secret[1..])), InvalidToken::Secret);
        assert_eq!(refused(&token.to_uppercase()), InvalidToken::Id);
        assert_eq!(refused(&format!("{token} ")), InvalidToken::Secret);
    }
}
