//! Any octets whatever, in any pieces, from any number of clients.

use std::io::Write;
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use codewheel_link::{Notice, Rs485Received, open_rs485};
use codewheel_station::rs485::BaudRate;
use proptest::prelude::*;

use crate::bench::PATIENCE;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Each of four clients signs its octets in the two upper bits, so all octets occur and each
    /// client's own can be told from the others'.
    #[test]
    fn what_each_client_says_arrives_once_and_in_its_order(
        says in prop::collection::vec(
            (0_u8..4, prop::collection::vec(0_u8..64, 1..1500), any::<bool>()),
            0..12,
        ),
    ) {
        let uri = "rs485-listen:127.0.0.1:0".parse().unwrap();
        let mut port = open_rs485(&uri, BaudRate::Mbit12).unwrap();
        let address = port.local_address().unwrap();
        let mut clients: Vec<_> = (0..4).map(|_| TcpStream::connect(address).unwrap()).collect();
        let mut said = vec![Vec::new(); 4];
        let mut received = Vec::new();
        for (who, octets, is_read) in &says {
            let signed: Vec<_> = octets.iter().map(|octet| who << 6 | octet).collect();
            clients[usize::from(*who)].write_all(&signed).unwrap();
            said[usize::from(*who)].extend(signed);
            if *is_read {
                received.extend(port.receive(Some(Duration::ZERO)).unwrap());
            }
        }
        for client in &clients {
            client.shutdown(Shutdown::Write).unwrap();
        }
        let mut left = 0;
        while left < 4 {
            let next = port.receive(Some(PATIENCE)).unwrap();
            left += usize::from(matches!(
                next,
                Some(Rs485Received::Notice(Notice::ClientLeft { frames_lost: 0, .. }))
            ));
            prop_assert!(next.is_some(), "{} of 4 left", left);
            received.extend(next);
        }
        let mut heard = vec![Vec::new(); 4];
        for received in received {
            if let Rs485Received::Octets(octets) = received {
                prop_assert!((1..=512).contains(&octets.len()));
                for octet in octets {
                    heard[usize::from(octet >> 6)].push(octet);
                }
            }
        }
        prop_assert!(heard == said);
    }
}
