"""The handshake between PC and box: requests, windows, "I Don't Believe You", start-up, probing; and its nodes."""
