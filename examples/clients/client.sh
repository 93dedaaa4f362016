#!/bin/sh
# A client of `alloc serve --http` with curl and jq: solves an instance file, and prints who does what.
#
#     alloc serve --http 8080 &
#     sh examples/clients/client.sh http://127.0.0.1:8080 demo.json local-search 200
set -eu
address=$1 instance=$2 method=${3:-auto} limit_ms=${4:-1000}

jq --compact-output --arg method "$method" --argjson limit "$limit_ms" \
    '{instance: ., method: $method, limit_ms: $limit}' "$instance" |
    curl --silent --show-error --max-time 60 --data-binary @- "$address/solve" |
    jq --raw-output 'if .error then "\(.error.kind): \(.error.message)\n" | halt_error(1)
        else "\(.result.makespan) h, \(.result.status)", (.result.assignment | to_entries[] | "\(.key)\t\(.value // "idle")") end'
