"""Telemetry: from the loop to every sink."""

import os

# Rerun's logger reads this once, as it is imported. Files are written without a footer on purpose
# (`rerun_sink`), and it would warn of that on every terminal.
os.environ.setdefault("RUST_LOG", "info,re_perf_telemetry=warn,re_log_encoding::rrd::file_sink=error")
