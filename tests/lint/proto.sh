#!/bin/sh
# buf's lint over the wire API: proto.sh NODE_MODULES, the folder that tests/run.sh installed buf into.
buf="$1/.bin/buf"
if ! [ -x "$buf" ]; then
  echo "buf is not installed; tests/run.sh installs it from npm."
  exit 77
fi
exec "$buf" lint "$(dirname "$0")/../../proto"
