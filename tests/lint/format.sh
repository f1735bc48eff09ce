#!/bin/sh
# Every C++ file as .clang-format wants it. To mend: run the same with -i in place of --dry-run --Werror.
cd "$(dirname "$0")/../.." || exit 1
find core server client tests \( -name "*.h" -o -name "*.cpp" \) -exec clang-format --dry-run --Werror {} +
