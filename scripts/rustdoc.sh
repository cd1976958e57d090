#!/bin/sh
# rustdoc with the options that only its nightly versions take, for the description of the public interface as JSON
# (cli/tests/interface.rs). Only rustdoc gets the variable: for cargo it would be a change that makes build scripts run again.
RUSTC_BOOTSTRAP=1 exec rustdoc "$@"
