"""Telemetry: from the loop to everybody who looks on."""
