//! The document that describes the API.

use crate::client::Page;

/// The contract: a route that is new stands here too.
const ROUTES: [(&str, &str); 14] = [
    ("get", "/api/v1/openapi.json"),
    ("get", "/api/v1/plant"),
    ("get", "/api/v1/events"),
    ("get", "/api/v1/buses/{bus}/devices/{device}/objects"),
    ("put", "/api/v1/buses/{bus}/devices/{device}/objects/{key}"),
    ("post", "/api/v1/buses/{bus}/devices/{device}/shaft"),
    ("put", "/api/v1/buses/{bus}/devices/{device}/power"),
    ("put", "/api/v1/buses/{bus}/devices/{device}/switches"),
    ("post", "/api/v1/buses/{bus}/devices/{device}/faults"),
    ("delete", "/api/v1/buses/{bus}/devices/{device}/faults/{kind}"),
    ("post", "/api/v1/buses/{bus}/devices/{device}/preset"),
    ("post", "/api/v1/buses/{bus}/devices/{device}/save"),
    ("post", "/api/v1/buses/{bus}/devices/{device}/restore"),
    ("post", "/api/v1/buses/{bus}/devices/{device}/reset"),
];

#[test]
fn the_document_names_every_route_and_no_other() {
    let page = Page::start();
    let document = page.json("/api/v1/openapi.json");
    assert!(document["openapi"].as_str().is_some_and(|version| version.starts_with("3.1.")));
    let mut found: Vec<(String, String)> = Vec::new();
    for (path, methods) in document["paths"].as_object().expect("paths") {
        found.extend(
            methods.as_object().expect("methods").keys().map(|m| (m.clone(), path.clone())),
        );
    }
    let mut contract: Vec<_> =
        ROUTES.iter().map(|(method, path)| ((*method).to_owned(), (*path).to_owned())).collect();
    found.sort();
    contract.sort();
    assert_eq!(found, contract);
}

#[test]
fn every_route_of_the_document_answers() {
    let page = Page::start();
    for (method, path) in ROUTES {
        if path == "/api/v1/events" {
            continue; // It never ends; others read it.
        }
        let path = path.replace("{bus}", "none").replace("{device}", "none");
        let path = path.replace("{key}", "none").replace("{kind}", "none");
        let address = page.address();
        let method = method.to_uppercase();
        let head =
            format!("{method} {path} HTTP/1.1\nHost: {address}\nContent-Type: application/json");
        let answer = page.send(&head, r#"{"on":true,"value":1,"kind":"stuck"}"#);
        match path.contains("none") {
            false => assert_eq!(answer.status, 200, "{method} {path}: {}", answer.body),
            // Either there is no such bus, or the body is not what this command takes.
            true => assert!(
                matches!(answer.status, 404 | 422) && !answer.body.contains("no such page"),
                "{method} {path}: {}",
                answer.body
            ),
        }
    }
}

#[test]
fn a_stranger_reads_the_document_and_finds_what_it_refers_to() {
    let page = Page::start();
    let text = page.get("/api/v1/openapi.json").body;
    let spec: oas3::OpenApiV3Spec = oas3::from_json(&text).expect("a document of OpenAPI");
    assert_eq!(spec.info.title, "Codewheel");
    let mut operations = 0;
    for (path, method, operation) in spec.operations() {
        operations += 1;
        assert!(operation.summary.is_some(), "{method} {path} has no summary");
        let responses = operation.responses.as_ref().expect("responses");
        for (status, response) in responses {
            let response = response.resolve(&spec).expect("a response");
            let is_described = response.description.is_some_and(|text| !text.is_empty());
            assert!(is_described, "{method} {path} {status} is not described");
        }
        for parameter in &operation.parameters {
            parameter.resolve(&spec).expect("a parameter");
        }
        if let Some(body) = &operation.request_body {
            body.resolve(&spec).expect("a body");
        }
    }
    assert_eq!(operations, ROUTES.len());
    let components = spec.components.as_ref().expect("components");
    for reference in text.split("\"$ref\":\"#/components/schemas/").skip(1) {
        let name = reference.split('"').next().expect("a name");
        assert!(components.schemas.contains_key(name), "{name} is not described");
    }
}
