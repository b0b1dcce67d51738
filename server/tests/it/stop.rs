//! The server ends when it is told to.

use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use crate::house::House;

#[tokio::test]
async fn half_sent_requests_do_not_hold_the_stop() {
    let house = House::open().await;
    let address = house.url.strip_prefix("http://").unwrap().to_owned();
    let beginnings: [&[u8]; 5] = [
        b"",
        b"P",
        b"GET /healthz HTTP/1.1\r\nHost:",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"POST /v1/tails/EC-MXA/uploads HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n{",
    ];
    let mut clients = Vec::new();
    for beginning in beginnings {
        let mut client = TcpStream::connect(&address).await.unwrap();
        client.write_all(beginning).await.unwrap();
        clients.push(client);
    }
    // Whoever is served proves that those before it were accepted.
    assert_eq!(house.get("/healthz").await.status(), 200);
    house.stop().await;
    for mut client in clients {
        let mut rest = Vec::new();
        // Closed or reset: either way the read ends.
        let _ = client.read_to_end(&mut rest).await;
    }
    assert!(TcpStream::connect(&address).await.is_err());
}
